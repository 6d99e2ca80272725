"""The location errors and gains that a chain needs, determined from its own rank.

Of all location errors of a serial chain many do the same thing at the tip; a complete and minimal set is
chosen in a fixed order, outermost axes first, so that an error is given to the axis nearest to the workpiece
or tool. For ``w C B X b Z Y (C1) t`` this gives the ten of SAMBA.

A chain with fewer than three linear axes, such as a robot, cannot bring its tool to any target; it is observed
from outside, its base frame and the points on its tool being unknown. There the zeros of the joints come first:
they are what a collision or an exchanged motor changes and what the control can correct. For six joints of an
elbow robot this gives 18 errors, with frame and one point 27: 4 a rotary joint and 3 for the point, the number
that is complete and minimal (Everett, Driels and Mooring, Kinematic modelling for robot calibration, IEEE ICRA
1987, for positions alone).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from monitor.machine import COMPONENTS, Chain, Joint, evaluate, touching_positions
from monitor.methods.chain.least_squares import RANK_TOLERANCE
from monitor.records import Array

# A plan that visits every axis well: what it cannot separate, no plan can. The numbers only have to be generic.
POSES, TARGETS, SEED = 40, 4, 20260217
# Half the travel of a linear axis in such a plan, mm.
REACH = 500.0
# A stylus on the spindle axis; its length is the lever of the axes of a swivel head.
TIP = (0.0, 0.0, -150.0)


def _candidates(chain: Chain) -> list[tuple[Joint, int]]:
    """Location errors that can matter, in the order of preference.

    The first axis of the work branch (of the tool branch where there is none) defines the machine frame. A
    turn about its own axis is a zero of an axis; a shift of a linear axis likewise.
    """
    frame = (chain.work or chain.tool)[0]
    depth = {
        joint.name: len(branch) - position
        for branch in (chain.work, chain.tool)
        for position, joint in enumerate(branch)
    }
    spindle_first = sorted(chain.joints, key=lambda joint: (joint.kind != "spindle", depth[joint.name]))
    candidates = []
    for joint in spindle_first:
        if joint is frame:
            continue
        shifts = [axis for axis in range(3) if joint.turns and axis != joint.main]
        turns = [3 + axis for axis in range(3) if axis != joint.main and joint.kind != "spindle"]
        candidates += [(joint, component) for component in (*turns, *shifts)]
    return candidates


def _generic_jacobian(chain: Chain) -> tuple[Array, Array]:
    """Derivatives by every error (N, J, 2, 6) and by the nuisance (N, p) at generic poses."""
    rng = np.random.default_rng(SEED)
    count = POSES * TARGETS
    half = {"linear": 0.0, "rotary": np.pi / 2, "spindle": np.pi}
    spread = np.array([half[joint.kind] for joint in chain.joints])
    positions = np.repeat(rng.uniform(-spread, spread, (POSES, len(chain.joints))), TARGETS, axis=0)
    points = rng.uniform(-150.0, 150.0, (TARGETS, 3))
    target = np.tile(points, (POSES, 1))
    errors = np.zeros((count, len(chain.joints), 2, 6))
    tip = np.array(TIP)
    positions = touching_positions(chain, positions, errors, target, tip)
    pose = evaluate(chain, positions, errors, target, tip, jacobian=True)
    assert pose.by_error is not None
    nuisance = np.zeros((count, 3, 3 * TARGETS + 3))
    for number in range(TARGETS):
        nuisance[number::TARGETS, :, 3 * number : 3 * number + 3] = -np.eye(3)
    nuisance[..., -3:] = pose.by_tip
    gains = [
        pose.by_error[:, :, index, 1, joint.main] * positions[:, None, index]
        for index, joint in enumerate(chain.joints)
        if joint.kind == "linear"
    ]
    explained = np.concatenate([nuisance, np.stack(gains, axis=-1)], axis=-1).reshape(3 * count, -1)
    return pose.by_error.reshape(3 * count, len(chain.joints), 2, 6), explained


def _candidates_outside(chain: Chain) -> list[tuple[Joint, int]]:
    """Location errors that an observer outside can identify: the zeros of the joints, shifts, tilts, outermost first.

    A tilt that the zero of the joint before does together with a shift is left to these two, as in Denavit and
    Hartenberg's parameters; with a short link between them it would come out as large as the link is short.
    """
    outwards = tuple(reversed(chain.tool))
    across = [(joint, axis) for joint in outwards for axis in range(3) if axis != joint.main]
    return [
        *((joint, 3 + joint.main) for joint in outwards if joint.turns),
        *((joint, axis) for joint, axis in across if joint.turns),
        *((joint, 3 + axis) for joint, axis in across),
    ]


def _generic_jacobian_outside(chain: Chain) -> tuple[Array, Array]:
    """The same for a chain that is observed from outside: the nuisance is a frame, points on the tool and gains."""
    rng = np.random.default_rng(SEED)
    count = POSES * TARGETS
    half = {"linear": REACH, "rotary": np.pi, "spindle": np.pi}
    spread = np.array([half[joint.kind] for joint in chain.joints])
    positions = np.repeat(rng.uniform(-spread, spread, (POSES, len(chain.joints))), TARGETS, axis=0)
    tip = np.tile(rng.uniform(-150.0, 150.0, (TARGETS, 3)), (POSES, 1))
    only_tool = replace(chain, work=(), tool=chain.tool)
    first = len(chain.work)
    none = np.zeros((count, len(chain.tool), 2, 6))
    pose = evaluate(only_tool, positions[:, first:], none, np.zeros(3), tip, jacobian=True)
    assert pose.by_error is not None
    by_error = np.zeros((count, 3, len(chain.joints), 2, 6))
    by_error[:, :, first:] = pose.by_error
    nuisance = np.zeros((count, 3, 3 * TARGETS + 6))
    for number in range(TARGETS):
        nuisance[number::TARGETS, :, 3 * number : 3 * number + 3] = pose.by_tip[number::TARGETS]
    nuisance[:, :, -6:-3] = np.eye(3)
    nuisance[:, :, -3:] = np.swapaxes(np.cross(np.eye(3), pose.residual[:, None, :]), 1, 2)
    gains = [
        by_error[:, :, index, 1, joint.main] * positions[:, None, index]
        for index, joint in enumerate(chain.joints)
        if joint.kind == "linear" and joint.branch == "tool"
    ]
    explained = np.concatenate([nuisance, *(gain[..., None] for gain in gains)], axis=-1)
    return by_error.reshape(3 * count, len(chain.joints), 2, 6), explained.reshape(3 * count, -1)


def location_candidates(chain: Chain, outside: bool | None = None) -> list[tuple[Joint, int]]:
    """Location errors that can be free, joint and component, in the order of preference; ``outside`` as for
    ``base_effects``."""
    if outside is None:
        outside = len(chain.of_kind("linear")) < 3
    return (_candidates_outside if outside else _candidates)(chain)


@cache
def base_effects(chain: Chain, outside: bool | None = None) -> tuple[str, ...]:
    """The effects of a complete and minimal model of a chain, location errors in chain order, then gains.

    ``outside`` says whether the chain is observed from outside; None: where it cannot touch a target at will.
    """
    if outside is None:
        outside = len(chain.of_kind("linear")) < 3
    by_error, explained = (_generic_jacobian_outside if outside else _generic_jacobian)(chain)
    basis = np.linalg.qr(explained / np.linalg.norm(explained, axis=0))[0]
    selected: set[tuple[str, int]] = set()
    for joint, component in location_candidates(chain, outside):
        column = by_error[:, chain.index(joint.name), 0, component]
        remainder = column - basis @ (basis.T @ column)
        remainder -= basis @ (basis.T @ remainder)
        if np.linalg.norm(remainder) > RANK_TOLERANCE * np.linalg.norm(column):
            basis = np.column_stack([basis, remainder / np.linalg.norm(remainder)])
            selected.add((joint.name, component))
    ordered = sorted(chain.joints, key=lambda joint: joint.kind == "spindle")
    locations = [
        f"E{COMPONENTS[component]}0{joint.name}"
        for joint in ordered
        for component in range(6)
        if (joint.name, component) in selected
    ]
    gains = [
        f"E{COMPONENTS[joint.main]}{joint.name}:poly1"
        for joint in sorted(chain.of_kind("linear"), key=lambda joint: joint.name)
        if not outside or joint.branch == "tool"
    ]
    return (*locations, *gains)
