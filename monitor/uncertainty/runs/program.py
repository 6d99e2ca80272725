"""A chain and its model as a program of elementary turns and shifts, from which trials are computed fast.

The vector from target to tip is the end of a walk from the last work axis through the bed to the tip. Every
step turns about or shifts along one coordinate axis; its amount is a set angle, a reading, or an unknown times
a number. Probings that share all set angles share the walk: a *class*. Only the readings, which are shifts,
differ within a class, so each probing costs three multiplications an axis. Nothing is linearised.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from monitor.effects import Context, Effect
from monitor.effects.effect import ChainBasis
from monitor.machine import LOCATION, MOTION, Joint
from monitor.methods.chain.touch import TouchProblem
from monitor.records import Array
from monitor.uncertainty.runs.touched_run import TouchedRun

Ints = npt.NDArray[np.int64]

#: Kinds of steps.
TURN_SET, TURN_ERROR, SHIFT_SET, SHIFT_READING, SHIFT_ERROR = range(5)
#: The kernel has room for so many linear axes (conventions: up to three).
AXES = 3
#: Error angles beyond this are left to the plain solver: the kernel's sine and cosine are series to the eighth
#: power, whose next terms are below 1e-19 here.
LARGEST_ANGLE = 1e-2
#: Half the step, in mm, by which basis functions are differentiated along a linear axis.
_STEP = 0.5e-3


@dataclass(frozen=True)
class Program:
    """Steps k in walking order, entries e of error steps, classes c, probings i in order of their class.

    ``kind``, ``axis`` (0 x, 1 y, 2 z), ``sign`` (K,) and ``first`` (K + 1,): a step's entries are
    ``first[k]:first[k + 1]``; for a reading ``reading[k]`` is the place of its axis. ``amount`` (C, K) holds
    set angles and shifts. ``segment_of``, ``begin``, ``end``, ``moves`` are the walk in segments (``_segments``).
    An entry adds ``value[c, e]`` times unknown ``unknown[e]``, times the reading of axis ``along[e]`` unless
    that is -1. ``start`` (C + 1,), ``target``, ``row`` (n, 3) of inputs (-1 for an axis that is not there)
    and ``weight`` (n, 3) describe the probings; ``between`` (D, 2), ``length_row``, ``length_weight`` (D,)
    the distances. ``scale`` (3,) turns readings into displacements. Unknowns beyond ``unknowns`` are ``held``
    values.
    """

    kind: Ints
    axis: Ints
    sign: Array
    reading: Ints
    first: Ints
    amount: Array
    unknown: Ints
    along: Ints
    value: Array
    segment_of: Ints
    begin: Ints
    end: Ints
    moves: npt.NDArray[np.bool_]
    start: Ints
    target: Ints
    row: Ints
    weight: Array
    scale: Array
    between: Ints
    length_row: Ints
    length_weight: Array
    targets_at: int
    unknowns: int
    held: Array


@dataclass
class _Step:
    """One step under construction: (n,) amounts of a set step, entries of an error step."""

    kind: int
    axis: int
    sign: float
    amount: Array
    reading: int = -1
    entries: tuple[tuple[int, int, Array], ...] = ()

    @property
    def axes(self) -> set[int]:
        """The linear axes whose readings act in the step."""
        along = {axis for _, axis, _ in self.entries}
        return {axis for axis in (*along, self.reading) if axis >= 0}

    @property
    def turns_with_reading(self) -> bool:
        """Whether the step is a turn whose angle follows a reading."""
        return self.kind == TURN_ERROR and any(along >= 0 for _, along, _ in self.entries)


def compile_program(run: TouchedRun) -> Program | None:
    """The program of a run's problem, or None where its model needs the plain way.

    That is so for effects of the artefact, for chains with more than three linear axes and where the chain stands at
    expected places beside its readings.
    """
    bases = _entries(run) if run.problem.read is None else None
    if bases is None or len(run.linear) > AXES:
        return None
    steps = _walk(run, bases)
    return _assemble(run, steps)


def _entries(run: TouchedRun) -> dict[tuple[int, int, int], list[tuple[int, int, Array]]] | None:
    """For every error term its entries: unknown, axis (-1: none) and value at every probing (n,)."""
    problem = run.problem
    context = problem.context
    by_term: dict[tuple[int, int, int], list[tuple[int, int, Array]]] = {}
    number = 0
    for effects, first in ((problem.base, 0), (problem.added, len(problem.local_names))):
        number = first
        for effect in effects:
            basis = effect.basis(context)
            if not isinstance(basis, ChainBasis):
                return None
            columns = basis.columns
            slopes = [_slope(effect, context, int(a)) for a in run.linear]
            entries = by_term.setdefault((basis.term.joint, basis.term.stage, basis.term.component), [])
            for column in range(columns.shape[1]):
                constant = columns[:, column].copy()
                for along, (a, slope) in enumerate(zip(run.linear, slopes, strict=True)):
                    if np.any(slope[:, column]):
                        constant -= slope[:, column] * context.positions[:, a]
                        entries.append((number, along, slope[:, column]))
                constant[np.abs(constant) < 1e-9 * np.max(np.abs(columns[:, column]), initial=0.0)] = 0.0
                if np.any(constant):
                    entries.append((number, -1, constant))
                number += 1
    return by_term


def _slope(effect: Effect, context: Context, axis: int) -> Array:
    """Derivative (n, k) of the basis along a linear axis, with rounding taken off."""
    ends = []
    for side in (-_STEP, _STEP):
        positions = context.positions.copy()
        positions[:, axis] += side
        # A new context: its cached travel directions must be those of the shifted positions.
        basis = effect.basis(replace(context, positions=positions))
        assert isinstance(basis, ChainBasis)
        ends.append(basis.columns)
    slope = np.asarray((ends[1] - ends[0]) / (2.0 * _STEP))
    size = np.max(np.abs(slope), axis=0, initial=0.0)
    rounding = 1e-9 * np.max(np.abs(ends[0]), axis=0, initial=0.0)
    slope[:, size < rounding] = 0.0
    # Slopes that are the same everywhere up to rounding are made so: their probings share a class.
    mean = slope.mean(axis=0)
    same = np.max(np.abs(slope - mean), axis=0, initial=0.0) < 1e-7 * np.maximum(size, 1e-300)
    slope[:, same] = np.round(mean[same], 9)
    return slope


def _slant(joint: Joint) -> list[tuple[int, float]]:
    """Turns (axis, rad), the outer one first, that take the main direction of a joint into its own."""
    main, second, third = (joint.main, (joint.main + 1) % 3, (joint.main + 2) % 3)
    along = np.array(joint.direction)
    if along[main] == 1.0:
        return []
    tilt = float(np.arccos(np.clip(along[main], -1.0, 1.0)))
    return [(main, float(np.arctan2(along[second], -along[third]))), (second, tilt)]


def _walk(run: TouchedRun, bases: dict[tuple[int, int, int], list[tuple[int, int, Array]]]) -> list[_Step]:
    chain = run.problem.context.chain
    count = run.probings
    places = {int(a): i for i, a in enumerate(run.linear)}

    def small(joint: int, stage: int, sign: float) -> list[_Step]:
        order = [0, 1, 2, 5, 4, 3]  # shift, then R_C R_B R_A
        steps = []
        for component in order if sign > 0 else order[::-1]:
            entries = tuple(bases.get((joint, stage, component), ()))
            if entries:
                kind = SHIFT_ERROR if component < 3 else TURN_ERROR
                steps.append(_Step(kind, component % 3, sign, np.zeros(count), entries=entries))
        return steps

    def motion(index: int, joint: Joint, sign: float) -> list[_Step]:
        axis = joint.main
        move = _Step(SHIFT_READING, axis, sign, np.zeros(count), reading=places.get(index, -1))
        if joint.turns:
            move = _Step(TURN_SET, axis, sign, run.problem.context.positions[:, index])
        # A slanted axis: turned into place, moved, turned back; the inverse of that is the same with the move inverted.
        slant = [_Step(TURN_SET, about, 1.0, np.full(count, angle)) for about, angle in _slant(joint)]
        back = [_Step(TURN_SET, about, 1.0, np.full(count, -angle)) for about, angle in _slant(joint)[::-1]]
        return [*slant, move, *back]

    def offset(joint: Joint, sign: float) -> list[_Step]:
        return [
            _Step(SHIFT_SET, axis, sign, np.full(count, joint.offset[axis]))
            for axis in range(3)
            if joint.offset[axis]
        ]

    steps: list[_Step] = []
    for index in range(len(chain.work) - 1, -1, -1):
        joint = chain.joints[index]
        steps += small(index, MOTION, -1.0) + motion(index, joint, -1.0)
        steps += small(index, LOCATION, -1.0) + offset(joint, -1.0)
    for index in range(len(chain.work), len(chain.joints)):
        joint = chain.joints[index]
        steps += offset(joint, 1.0) + small(index, LOCATION, 1.0)
        steps += motion(index, joint, 1.0) + small(index, MOTION, 1.0)
    tip = len(run.problem.local_names) - 3
    ones = np.ones(count)
    steps += [
        _Step(SHIFT_ERROR, axis, 1.0, np.zeros(count), entries=((tip + axis, -1, ones),)) for axis in range(3)
    ]
    return steps


def _assemble(run: TouchedRun, steps: list[_Step]) -> Program:
    count = run.probings
    problem = run.problem
    entries = [entry for step in steps for entry in step.entries]
    amounts = np.array([step.amount for step in steps]).T
    values = np.array([value for _, _, value in entries]).T.reshape(count, len(entries))
    sample, class_of = _classes(steps, amounts, values)
    order = np.argsort(class_of, kind="stable")
    targets = np.searchsorted(np.array(problem.targets), problem.context.target)
    rows = np.full((count, AXES), -1, dtype=np.int64)
    rows[:, : len(run.linear)] = np.arange(count * len(run.linear)).reshape(count, -1)
    scale = np.zeros(AXES)
    scale[: len(run.linear)] = run.signs
    first = np.concatenate([[0], np.cumsum([len(step.entries) for step in steps])])
    segment_of, begin, end, moves = _segments(steps, amounts, values, first)
    return Program(
        kind=np.array([step.kind for step in steps]),
        axis=np.array([step.axis for step in steps]),
        sign=np.array([step.sign for step in steps]),
        reading=np.array([step.reading for step in steps]),
        first=first.astype(np.int64),
        amount=np.ascontiguousarray(amounts[sample]),
        unknown=np.array([number for number, _, _ in entries], dtype=np.int64),
        along=np.array([along for _, along, _ in entries], dtype=np.int64),
        value=np.ascontiguousarray(values[sample]),
        segment_of=segment_of,
        begin=begin,
        end=end,
        moves=moves,
        start=np.concatenate([[0], np.cumsum(np.bincount(class_of))]).astype(np.int64),
        target=targets[order].astype(np.int64),
        row=np.ascontiguousarray(rows[order]),
        weight=np.ascontiguousarray(problem.sigma[order] ** -2.0),
        scale=scale,
        between=_ends(problem),
        length_row=count * len(run.linear) + np.arange(len(problem.distances)),
        length_weight=np.array([distance.standard_uncertainty**-2.0 for distance in problem.distances]),
        targets_at=len(problem.base_names),
        unknowns=run.unknowns,
        held=np.asarray(run.common, dtype=np.float64),
    )


def _classes(steps: list[_Step], amounts: Array, values: Array) -> tuple[Ints, Ints]:
    """A probing of every class (C,), and the class of every probing (n,)."""
    key = np.concatenate([amounts, values], axis=1)
    # A turn whose angle follows a reading differs from probing to probing.
    if any(step.turns_with_reading for step in steps):
        key = np.column_stack([key, np.arange(len(key))])
    size = np.max(np.abs(key), axis=0, initial=0.0)
    _, sample, inverse = np.unique(
        np.round(key / np.where(size > 0.0, size, 1.0), 11), axis=0, return_index=True, return_inverse=True
    )
    return sample, inverse.ravel()


def _ends(problem: TouchProblem) -> Ints:
    """The two targets of every distance (D, 2)."""
    ends = [[problem.targets.index(name) for name in distance.between] for distance in problem.distances]
    return np.array(ends, dtype=np.int64).reshape(-1, 2)


def _segments(
    steps: list[_Step], amounts: Array, values: Array, first: Ints
) -> tuple[Ints, Ints, Ints, npt.NDArray[np.bool_]]:
    """The walk as items: segments of steps that are the same for all probings, and single steps between.

    ``segment_of`` is a segment's number or -1, ``begin`` and ``end`` its steps, ``moves`` (items, 3) whether a reading
    acts in it.
    """
    items: list[tuple[int, int, int]] = []
    segments = 0
    for k, step in enumerate(steps):
        of_step = np.column_stack([amounts[:, k], values[:, first[k] : first[k + 1]]])
        same = not step.turns_with_reading and bool(np.all(np.ptp(of_step, axis=0) == 0.0))
        if same and items and items[-1][0] >= 0:
            items[-1] = (items[-1][0], items[-1][1], k + 1)
        elif same:
            items.append((segments, k, k + 1))
            segments += 1
        else:
            items.append((-1, k, k + 1))
    moves = np.zeros((len(items), AXES), dtype=np.bool_)
    for index, (_, begin, end) in enumerate(items):
        for step in steps[begin:end]:
            moves[index, sorted(step.axes)] = True
    segment_of, begin_of, end_of = (np.array(column, dtype=np.int64) for column in zip(*items, strict=True))
    return segment_of, begin_of, end_of, moves
