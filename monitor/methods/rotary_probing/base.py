"""The location errors of rotary axes that touching one piece at indexed angles determines, by the chain's rank.

The linear axes and the stylus tip count as known, the piece as unknown: whatever does the same as moving the piece
or the points on it drops out. For ``w C A Y b X Z t`` these are the eight of Ibaraki et al. 2012, Table 1.
The zero of A, their alpha_AY, is EA0C here: a turn about A between A and C, which does the same.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from monitor.exceptions import DataError
from monitor.machine import COMPONENTS, Chain, evaluate, touching_positions
from monitor.methods.chain.base_effects import base_effects
from monitor.methods.chain.least_squares import RANK_TOLERANCE
from monitor.records import Array

# A plan that visits the axes well: what it cannot tell, no plan can. The numbers only have to be generic.
POSES, POINTS, SEED = 40, 24, 20260331
# A stylus on the spindle axis; its length is the lever of the axes of a swivel head.
TIP = (0.0, 0.0, -150.0)
# A component of a unit direction above this: the turn is about the axis itself.
OWN_AXIS = 0.999


def _generic(chain: Chain) -> tuple[Array, Array]:
    """Derivatives (N, J, 6) of the touches by the location errors and (N, k) by what moves the points."""
    rng = np.random.default_rng(SEED)
    spread = np.array([np.pi / 2 if joint.kind == "rotary" else 0.0 for joint in chain.joints])
    positions = np.repeat(rng.uniform(-spread, spread, (POSES, len(chain.joints))), POINTS, axis=0)
    point = np.tile(rng.uniform(-150.0, 150.0, (POINTS, 3)), (POSES, 1))
    normal = rng.standard_normal((POINTS, 3))
    normal = np.tile(normal / np.linalg.norm(normal, axis=1, keepdims=True), (POSES, 1))
    errors = np.zeros((len(point), len(chain.joints), 2, 6))
    tip = np.array(TIP)
    positions = touching_positions(chain, positions, errors, point, tip)
    pose = evaluate(chain, positions, errors, point, tip, jacobian=True)
    assert pose.by_error is not None
    heights = np.tile(np.eye(POINTS), (POSES, 1))
    return np.einsum("ni,nijk->njk", normal, pose.by_error[:, :, :, 0]), heights


def _candidates(chain: Chain) -> list[tuple[str, int]]:
    """Location errors of the rotary axes in the order of preference.

    First those by which SAMBA names the same thing, so that both methods have one trend; then shifts and turns, bed
    outwards; last the turns about an axis's own axis, which are zeros of an axis.
    """
    rotary = chain.of_kind("rotary")
    of_samba = {text[1:] for text in base_effects(chain)}
    every = [(joint, component) for joint in rotary for component in range(6)]
    preferred = [(j.name, k) for j, k in every if f"{COMPONENTS[k]}0{j.name}" in of_samba]
    zeros = [(j.name, k) for j, k in every if k >= 3 and abs(j.direction[k - 3]) > OWN_AXIS]
    others = [(j.name, k) for j, k in every]
    return list(
        dict.fromkeys([*preferred, *(candidate for candidate in others if candidate not in zeros), *zeros])
    )


@cache
def rotary_base(chain: Chain) -> tuple[str, ...]:
    """The location errors of the rotary axes, bed outwards, shifts before turns; complete and minimal.

    Raises DataError for a chain without a rotary axis.
    """
    if not chain.of_kind("rotary"):
        raise DataError(f"'{chain.topology}' has no rotary axis: rotary-probing finds errors of rotary axes")
    by_error, explained = _generic(chain)
    basis = np.linalg.qr(explained)[0]
    selected: set[str] = set()
    for name, component in _candidates(chain):
        column = by_error[:, chain.index(name), component]
        remainder = column - basis @ (basis.T @ column)
        remainder -= basis @ (basis.T @ remainder)
        if np.linalg.norm(remainder) > RANK_TOLERANCE * np.linalg.norm(column):
            basis = np.column_stack([basis, remainder / np.linalg.norm(remainder)])
            selected.add(f"E{COMPONENTS[component]}0{name}")
    ordered = [f"E{letter}0{joint.name}" for joint in chain.of_kind("rotary") for letter in COMPONENTS]
    return tuple(text for text in ordered if text in selected)
