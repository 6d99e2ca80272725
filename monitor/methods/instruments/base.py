"""The errors that are free in every run: those of the chain that the setups, together, can tell apart.

Every kind of reading is evaluated at generic poses with generic places; its own unknowns and the gains of linear axes
are taken out, and errors are then selected in a fixed order, as in ``chain.base_effects``, each if it does what none
before it did. So a mount of two axes has six: two zeros, two tilts of the first axis, the non-perpendicularity, and
the collimation, a constant turn of the tool (P. T. Wallace, TPOINT: IH, ID, ME, MA, NP, CH).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from monitor.effects import Context
from monitor.machine import COMPONENTS, MOTION, Chain
from monitor.methods.chain.base_effects import location_candidates
from monitor.methods.chain.identification import TakenUp
from monitor.methods.chain.least_squares import RANK_TOLERANCE
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.methods.instruments.reading import COSINE, Rows
from monitor.methods.instruments.readings import readings
from monitor.methods.instruments.readings.direction import Direction
from monitor.methods.instruments.readings.pose import Pose
from monitor.records import Array, Setup
from monitor.sources import SCALE

POSES, SEED = 120, 20260217
# Travel of a linear axis and places of points at generic poses, mm.
REACH, PLACES = 400.0, 150.0
# Derivatives below this part of the largest are rounding.
ROUNDING = 1e-9
# What may be known of a setup and says of no place where it is.
NO_PLACE = frozenset({"direction", "length", SCALE})


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
    by_error, by_unknowns = _generic(chain, setups)
    by_error = _without_rounding(by_error)
    gains = [
        (index, joint.main)
        for index, joint in enumerate(chain.joints)
        if joint.kind == "linear" and np.any(by_error[:, index, 1, joint.main])
    ]
    positions = _positions(chain)
    rows = len(by_error) // len(positions)
    columns = [by_error[:, index, 1, axis] * np.repeat(positions[:, index], rows) for index, axis in gains]
    basis, seen_gains = _orthonormal(by_unknowns), []
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


@cache
def taken_up(chain: Chain, setups: tuple[Setup, ...]) -> tuple[TakenUp, ...]:
    """Location errors, turns of the tool and outer frames that have no number of their own, with the free errors that
    do the same, or unknown frames and places; with none where the setups see nothing of them."""
    by_error, by_unknowns = _generic(chain, setups)
    by_error = _without_rounding(by_error)
    base = instrument_base(chain, setups)
    names = [joint.name for joint in chain.joints]
    columns = {_name(names, term): by_error[:, *term] for term in _candidates(chain, setups)}
    free = {name: column for name, column in columns.items() if name in base}
    others = np.column_stack([*free.values(), by_unknowns])
    length = np.linalg.norm(others, axis=0)
    others = others / np.where(length == 0, 1.0, length)
    groups = [
        TakenUp(name, _members(column, others, tuple(free)))
        for name, column in columns.items()
        if name not in base
    ]
    return (*groups, *_zeros(chain, by_error, others, tuple(free)), *_frames(chain, setups, free))


def _zeros(chain: Chain, by_error: Array, others: Array, free: tuple[str, ...]) -> Iterator[TakenUp]:
    """The zeros of rotary axes that free errors do at any pose: that of C in ``C B t`` is a turn of B about Z."""
    usual = {(joint.name, component) for joint, component in location_candidates(chain)}
    for index, joint in enumerate(chain.joints):
        column = by_error[:, index, 0, 3 + joint.main]
        # Those of a chain that is looked at from outside, and of the first axis, are candidates themselves.
        is_told = (joint.name, 3 + joint.main) in usual or joint is (chain.work or chain.tool)[0]
        if joint.kind == "rotary" and not is_told and np.any(column) and not _is_new(others, column):
            members = _members(column, others, free)
            if members:
                yield TakenUp(f"E{COMPONENTS[3 + joint.main]}0{joint.name}", members)


def _is_new(others: Array, column: Array) -> bool:
    """Whether a column (N,) does what the others (N, q) do not."""
    return _with(_orthonormal(others), column)[1]


def _members(column: Array, others: Array, names: tuple[str, ...]) -> tuple[str, ...]:
    """The names of the columns (N, q) that make up a column (N,); those beyond the names are unknowns of setups."""
    if not np.any(column):
        return ()
    shares = np.linalg.lstsq(others, column / np.linalg.norm(column), rcond=1e-9)[0]
    large = np.abs(shares) > ROUNDING**0.5
    members = [name for name, is_large in zip(names, large[: len(names)], strict=True) if is_large]
    return (*members, *(("the unknowns of the setups",) if large[len(names) :].any() else ()))


def _frames(chain: Chain, setups: tuple[Setup, ...], free: dict[str, Array]) -> Iterator[TakenUp]:
    """The outer frame of the first direction: no unknown of its own, because location errors turn it."""
    first = next((setup for setup in setups if setup.reading == "direction"), None)
    if first is None or "frame" in first.known or not free:
        return
    problem = _generic_problem(chain, setups, floating=first.id)
    pose = problem.evaluated(problem.start, np.zeros(0), jacobian=True)
    index = [part.id for part in problem.parts].index(first.id)
    turns = pose.by_own[:, :, problem.own_columns[index]].reshape(
        pose.by_own.shape[0] * pose.by_own.shape[1], -1
    )
    others = np.column_stack(list(free.values()))
    others = others / np.linalg.norm(others, axis=0)
    members = dict.fromkeys(name for column in turns.T for name in _members(column, others, tuple(free)))
    yield TakenUp(f"the frame of {first.id}", tuple(members))


def _name(names: Sequence[str], term: tuple[int, int, int]) -> str:
    joint, stage, component = term
    return f"E{COMPONENTS[component]}{'' if stage == MOTION else '0'}{names[joint]}" + ":const" * (
        stage == MOTION
    )


def _candidates(chain: Chain, setups: tuple[Setup, ...]) -> list[tuple[int, int, int]]:
    """Joint, stage and component of every error that may be free, in the order of preference.

    Those of every chain first; then those of the first axis, which an outer frame that is known shows, its zero before
    its tilts; for directions constant turns of what points and of what it is seen from; at last all other location
    errors, which show where places are known.
    """
    usual = [(chain.index(joint.name), 0, component) for joint, component in location_candidates(chain)]
    frame = (chain.work or chain.tool)[0]
    first = chain.index(frame.name)
    of_first = [(first, 0, component) for component in (3 + frame.main, 3, 4, 5, 0, 1, 2)]
    # What unknown places take up elsewhere shows where a setup states them.
    places_known = any(set(setup.known) - NO_PLACE for setup in setups)
    others = [
        (index, 0, component)
        for index, joint in enumerate(chain.joints)
        for component in (3, 4, 5, 0, 1, 2)
        if places_known and joint.kind != "spindle"
    ]
    if all(setup.reading != "direction" for setup in setups):
        return list(dict.fromkeys([*usual, *of_first, *others]))
    of_tool = [(len(chain.joints) - 1, 1, component) for component in (3, 4, 5)] if chain.tool else []
    of_table = [(len(chain.work) - 1, 1, component) for component in (3, 4, 5)] if chain.work else []
    return list(dict.fromkeys([*usual, *of_first, *of_tool, *of_table, *others]))


@cache
def _positions(chain: Chain) -> Array:
    """Generic positions (P, J)."""
    half = {"linear": REACH, "rotary": np.pi, "spindle": np.pi}
    spread = np.array([half[joint.kind] for joint in chain.joints])
    return np.random.default_rng(SEED).uniform(-spread, spread, (POSES, len(chain.joints)))


def _generic(chain: Chain, setups: tuple[Setup, ...]) -> tuple[Array, Array]:
    """Derivatives (N, J, 2, 6) of all readings by every error, and by the unknowns of the setups (N, q)."""
    problem = _generic_problem(chain, setups)
    pose = problem.evaluated(problem.start, np.zeros(0), jacobian=True)
    assert pose.by_error is not None
    rows = pose.residual.size
    free = [not name.endswith(COSINE) for name in problem.own_names]
    return pose.by_error.reshape(rows, len(chain.joints), 2, 6), pose.by_own[..., free].reshape(
        rows, sum(free)
    )


def _generic_problem(
    chain: Chain, setups: tuple[Setup, ...], floating: str | None = None
) -> InstrumentProblem:
    """All setups at generic poses; ``floating`` is the id of a direction whose frame is unknown besides."""
    rng = np.random.default_rng(SEED + 1)
    positions = _positions(chain)
    count = len(positions)
    parts = []
    is_first = True
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
            elapsed=np.zeros(count),
            guess=np.zeros((count, 0)),
        )
        reading, rows = kind.of(placed, rows)
        if isinstance(reading, Direction):
            # What is seen is what the tool points at, as on a machine without errors.
            rows = replace(rows, measured=reading.pointed(rows))
            unknown = not is_first and "frame" not in setup.known
            reading = replace(reading, floating=unknown or setup.id == floating)
            is_first = False
        if isinstance(reading, Pose):
            rows = replace(rows, measured=reading.ideal(rows))
        at = number * count + np.arange(count)
        # Drift, scale and tool point are known beforehand: what does the same as these has a number all the same.
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
    return InstrumentProblem(context, (), (), np.ones((rows_in_all, numbers)), parts=tuple(parts))


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
    length = float(np.linalg.norm(remainder))
    if size == 0.0 or length <= RANK_TOLERANCE * size:
        return basis, False
    return np.column_stack([basis, remainder / length]), True
