"""The errors that are free in every run: those of the chain that the setups, together, can tell apart.

Every kind of reading is evaluated at generic poses with generic places; its own unknowns and the gains of linear axes
are taken out, and errors are then selected in a fixed order, as in ``chain.base_effects``, each if it does what none
before it did. So a mount of two axes has six: two zeros, two tilts of the first axis, the non-perpendicularity, and
the collimation, a constant turn of the tool (P. T. Wallace, TPOINT: IH, ID, ME, MA, NP, CH).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from monitor.effects import Context
from monitor.machine import COMPONENTS, MOTION, Chain
from monitor.methods.chain.base_effects import location_candidates
from monitor.methods.chain.least_squares import RANK_TOLERANCE
from monitor.methods.instruments.problem import InstrumentProblem, Part
from monitor.methods.instruments.reading import Rows
from monitor.methods.instruments.readings import readings
from monitor.methods.instruments.readings.direction import Direction
from monitor.records import Array, Setup

POSES, SEED = 120, 20260217
# Travel of a linear axis and places of points at generic poses, mm.
REACH, PLACES = 400.0, 150.0
# Derivatives below this part of the largest are rounding.
ROUNDING = 1e-9


def mount_setup(chain: Chain) -> Setup:
    """A setup that sees where the tool points, across the last axis: what a machine of rotary axes alone is for."""
    last = chain.joints[-1].main
    pointing = np.eye(3)[{0: 2, 1: 0, 2: 0}[last]]
    return Setup("pointing", "direction", 1e-6, tool_direction=(pointing[0], pointing[1], pointing[2]))


def usual_setups(chain: Chain) -> tuple[Setup, ...]:
    """What a machine is usually measured by where no campaign says it: its pointing if it has rotary axes alone that
    meet in one point, else the vector between tool and work."""
    meet = all(joint.turns and not any(joint.offset) for joint in chain.joints)
    return (mount_setup(chain),) if meet else (Setup("vector", "vector", 1e-3),)


@cache
def instrument_base(chain: Chain, setups: tuple[Setup, ...]) -> tuple[str, ...]:
    """The effects that are free in every run of campaigns with these setups, location errors in chain order first."""
    by_error, known = _generic(chain, setups)
    by_error = _without_rounding(by_error)
    gains = [
        (index, joint.main)
        for index, joint in enumerate(chain.joints)
        if joint.kind == "linear" and np.any(by_error[:, index, 1, joint.main])
    ]
    positions = _positions(chain)
    rows = len(by_error) // len(positions)
    columns = [by_error[:, index, 1, axis] * np.repeat(positions[:, index], rows) for index, axis in gains]
    basis, seen_gains = _orthonormal(known), []
    for gain, column in zip(gains, columns, strict=True):
        basis, is_new = _with(basis, column)
        if is_new:
            seen_gains.append(gain)
    selected: list[tuple[int, int, int]] = []
    for joint, stage, component in _candidates(chain, setups):
        basis, is_new = _with(basis, by_error[:, joint, stage, component])
        if is_new:
            selected.append((joint, stage, component))
    names = [joint.name for joint in chain.joints]
    locations = [f"E{COMPONENTS[c]}0{names[j]}" for j, stage, c in sorted(selected) if stage != MOTION]
    constant = [f"E{COMPONENTS[c]}{names[j]}:const" for j, stage, c in sorted(selected) if stage == MOTION]
    return (*locations, *constant, *sorted(f"E{COMPONENTS[axis]}{names[j]}:poly1" for j, axis in seen_gains))


def taken_up(chain: Chain, setups: tuple[Setup, ...]) -> dict[str, tuple[str, ...]]:
    """Location errors and turns of the tool that have no number of their own, and the free errors that do the same;
    none where a reading does not see them at all."""
    by_error, known = _generic(chain, setups)
    by_error = _without_rounding(by_error)
    base = instrument_base(chain, setups)
    names = [joint.name for joint in chain.joints]
    terms = {_name(names, term): term for term in _candidates(chain, setups)}
    free = {name: by_error[:, j, s, c] for name, (j, s, c) in terms.items() if name in base}
    groups: dict[str, tuple[str, ...]] = {}
    for name, (j, s, c) in terms.items():
        column = by_error[:, j, s, c]
        if name in base:
            continue
        if not np.any(column):
            groups[name] = ()
            continue
        others = np.column_stack([*free.values(), known])
        scale = np.linalg.norm(others, axis=0)
        shares = np.linalg.lstsq(others / np.where(scale == 0, 1.0, scale), column, rcond=1e-9)[0]
        large = np.abs(shares) > 1e-6 * np.abs(shares).max()
        members = [other for other, is_large in zip(free, large, strict=False) if is_large]
        groups[name] = (*members, *(("frame or places of the setup",) if large[len(free) :].any() else ()))
    return groups


def _name(names: Sequence[str], term: tuple[int, int, int]) -> str:
    joint, stage, component = term
    return f"E{COMPONENTS[component]}{'' if stage == MOTION else '0'}{names[joint]}" + ":const" * (
        stage == MOTION
    )


def _candidates(chain: Chain, setups: tuple[Setup, ...]) -> list[tuple[int, int, int]]:
    """Joint, stage and component of every error that may be free, in the order of preference.

    Those of every chain first; then those of the first axis, which an outer frame that is known shows, its zero before
    its tilts; at last, for directions, constant turns of what points and of what it is seen from.
    """
    usual = [(chain.index(joint.name), 0, component) for joint, component in location_candidates(chain)]
    frame = (chain.work or chain.tool)[0]
    first = chain.index(frame.name)
    of_first = [(first, 0, component) for component in (3 + frame.main, 3, 4, 5, 0, 1, 2)]
    if all(setup.reading != "direction" for setup in setups):
        return list(dict.fromkeys([*usual, *of_first]))
    of_tool = [(len(chain.joints) - 1, 1, component) for component in (3, 4, 5)] if chain.tool else []
    of_table = [(len(chain.work) - 1, 1, component) for component in (3, 4, 5)] if chain.work else []
    return list(dict.fromkeys([*usual, *of_first, *of_tool, *of_table]))


@cache
def _positions(chain: Chain) -> Array:
    """Generic positions (P, J)."""
    half = {"linear": REACH, "rotary": np.pi, "spindle": np.pi}
    spread = np.array([half[joint.kind] for joint in chain.joints])
    return np.random.default_rng(SEED).uniform(-spread, spread, (POSES, len(chain.joints)))


def _generic(chain: Chain, setups: tuple[Setup, ...]) -> tuple[Array, Array]:
    """Derivatives (N, J, 2, 6) of all readings by every error, and by the unknowns of the setups (N, q)."""
    rng = np.random.default_rng(SEED + 1)
    positions = _positions(chain)
    count = len(positions)
    parts = []
    floating = False
    for number, setup in enumerate(setups):
        work, tool, nominal = rng.uniform(-PLACES, PLACES, (3, 3))
        placed = replace(
            setup,
            work_point=tuple(work),
            tool_point=tuple(tool),
            known=tuple({*setup.known, "frame"}) if setup.reading == "direction" else setup.known,
        )
        kind = readings()[setup.reading]
        rows = Rows(
            chain=chain,
            run=np.zeros(count, dtype=np.int64),
            target=np.full(count, setup.id),
            measured=rng.uniform(-PLACES, PLACES, (count, len(kind.columns))),
            positions=positions,
            nominal=np.tile(nominal, (count, 1)),
            guess=np.zeros((count, 0)),
        )
        reading, rows = kind.of(placed, rows)
        if isinstance(reading, Direction):
            reading = replace(reading, floating=floating and "frame" not in setup.known)
            floating = True
        at = number * count + np.arange(count)
        parts.append(Part(setup.id, reading, rows, at))
    rows_in_all = count * len(setups)
    context = Context(
        chain=chain,
        positions=np.tile(positions, (len(setups), 1)),
        run=np.ones(rows_in_all, dtype=np.int64),
        sequence=np.arange(rows_in_all),
        time=np.arange(float(rows_in_all)),
        day_time=np.arange(float(rows_in_all)),
        run_time=np.zeros(rows_in_all),
        target=np.full(rows_in_all, "1"),
        nominal=np.zeros((rows_in_all, 3)),
        columns={},
    )
    numbers = max(len(part.reading.numbers) for part in parts)
    problem = InstrumentProblem(context, (), (), np.ones((rows_in_all, numbers)), parts=tuple(parts))
    pose = problem.evaluated(problem.start, np.zeros(0), jacobian=True)
    assert pose.by_error is not None
    own = pose.by_own.reshape(rows_in_all * numbers, -1)
    return pose.by_error.reshape(rows_in_all * numbers, len(chain.joints), 2, 6), own


def _without_rounding(by_error: Array) -> Array:
    """Derivatives (N, J, 2, 6) with those set to zero of which only rounding is there: a turn about what points."""
    size = np.sqrt(np.sum(by_error**2, axis=0))
    return np.where(size > ROUNDING * size.max(initial=0.0), by_error, 0.0)


def _orthonormal(columns: Array) -> Array:
    """An orthonormal basis (N, r) of columns (N, q)."""
    scale = np.linalg.norm(columns, axis=0)
    scaled = columns / np.where(scale == 0, 1.0, scale)
    u, values, _ = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(u[:, values > RANK_TOLERANCE])


def _with(basis: Array, column: Array) -> tuple[Array, bool]:
    """The basis with a further column (N,), and whether it does anything new."""
    size = float(np.linalg.norm(column))
    remainder = column - basis @ (basis.T @ column)
    remainder = remainder - basis @ (basis.T @ remainder)
    left = float(np.linalg.norm(remainder))
    if size == 0.0 or left <= RANK_TOLERANCE * size:
        return basis, False
    return np.column_stack([basis, remainder / left]), True
