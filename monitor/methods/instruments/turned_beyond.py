"""Positions that were left and approached again from beyond, which the positions alone do not say.

A test of positioning there and back turns beyond its ends (ISO 230-2, figure 1): the second of two readings at an end
was approached from the other side, and the first position of a run in the direction of the move after it. Who waits at
the end and reads twice has the same positions. Only a play makes the two differ, and by its readings they are told,
against a play that follows the moves and against a lag, which vanishes where nothing moved. After a long pause they
cannot: what drifted meanwhile looks the same.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from monitor.approach import ONE_TARGET, ONE_TARGET_RAD, directions_of_approach, targets_of
from monitor.effects import Context
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.readings.angle import Angle
from monitor.methods.instruments.readings.displacement import Displacement
from monitor.records import Array

#: Twice the logarithm of the likelihood ratio by which the readings have to say that a test turned beyond its ends.
LIKELIER = 12.0
#: A row that comes so many times as late after the one before as the rows of its run mostly do follows a pause.
LONG_PAUSE = 3.0
#: What is written of a reading in mm: exact readings leave nothing.
ROUNDING = 1e-6


def turned_beyond(context: Context, parts: Sequence[Part]) -> npt.NDArray[np.int64] | None:
    """The sign (n, J) of the move that ended at a row, where a setup in which one axis moves alone shows another than
    its positions do; 0 elsewhere. None where no setup shows one."""
    approach = np.zeros(context.positions.shape, dtype=np.int64)
    for part in parts:
        joint = _axis_of(part)
        if joint is None:
            continue
        by_moves = context.travel[part.at, joint]
        deviation = part.rows.measured[:, 0] - _ideal(context, part)
        beyond = _as_standards_have_it(part, joint, by_moves)
        plain = [by_moves, *_lags(context.moves[part.at, joint], part, joint)]
        columns = np.array([*beyond, *plain], dtype=np.float64).T
        remaining = _left_over(part, joint, deviation, columns) + len(deviation) * ROUNDING**2
        likeliest, otherwise = int(np.argmin(remaining[: len(beyond)])), remaining[len(beyond) :].min()
        freedom = (
            len(deviation) - len(np.unique(_targets(part, joint))) - 2 * len(np.unique(part.rows.run)) - 1
        )
        if freedom > 0 and freedom * np.log(otherwise / remaining[likeliest]) > LIKELIER:
            approach[part.at, joint] = np.where(beyond[likeliest] != by_moves, beyond[likeliest], 0)
    return approach if approach.any() else None


def _axis_of(part: Part) -> int | None:
    """The axis that moves alone in the rows of a laser or of what measures an angle; None where several do, or where
    another kind of instrument reads."""
    if not isinstance(part.reading, Displacement | Angle):
        return None
    several = [len(np.unique(_targets(part, joint))) > 1 for joint in range(part.rows.positions.shape[1])]
    moving = np.flatnonzero(several)
    return int(moving[0]) if len(moving) == 1 else None


def _ideal(context: Context, part: Part) -> Array:
    """What a machine without errors shows to an instrument (m,)."""
    assert context.instruments is not None
    return np.asarray(context.instruments.ideal[part.at, 0])


def _targets(part: Part, joint: int) -> npt.NDArray[np.int64]:
    """The target (m,) of every row of a setup."""
    turns = part.rows.chain.joints[joint].turns
    return targets_of(part.rows.positions[:, joint], ONE_TARGET_RAD if turns else ONE_TARGET)


def _as_standards_have_it(part: Part, joint: int, by_moves: Array) -> list[Array]:
    """The directions (m,) of approach as standards have them: at all rows, at all but the first of each run, and at
    these alone; after a long pause those of the moves."""
    targets = _targets(part, joint).astype(np.float64)
    directions, is_first = by_moves.copy(), np.zeros(len(targets), dtype=bool)
    for run in np.unique(part.rows.run):
        rows = np.flatnonzero(part.rows.run == run)
        is_first[rows[0]] = True
        if np.ptp(targets[rows]) > 0.0:
            after_pause = _follows_pause(part.rows.elapsed[rows])
            directions[rows] = np.where(after_pause, by_moves[rows], directions_of_approach(targets[rows]))
    return [directions, np.where(is_first, by_moves, directions), np.where(is_first, directions, by_moves)]


def _follows_pause(elapsed: Array) -> npt.NDArray[np.bool_]:
    """Whether a row (m,) of a run comes much later after the one before than the rows mostly do."""
    steps = np.diff(elapsed, prepend=elapsed[:1])
    return np.asarray(steps > LONG_PAUSE * np.median(steps[1:]))


def _lags(moves: Array, part: Part, joint: int) -> list[Array]:
    """What lags (m,) leave after the last moves (m,): as much at a position that is read again, and nothing there."""
    same = np.diff(_targets(part, joint), prepend=-1) == 0
    same &= np.diff(part.rows.run, prepend=part.rows.run[0]) == 0
    return [moves, np.where(same, 0.0, moves)]


def _left_over(part: Part, joint: int, deviation: Array, after_moves: Array) -> Array:
    """The sum of squares (k,) that is left of deviations (m,) by each of what (m, k) moves may leave, a mean at every
    target, and a zero and an even drift of every run."""
    targets = _targets(part, joint)
    of_run = (part.rows.run[:, None] == np.unique(part.rows.run)).astype(np.float64)
    columns = np.column_stack([of_run, of_run * part.rows.elapsed[:, None], after_moves, deviation])
    for column in columns.T:
        column -= (np.bincount(targets, column) / np.bincount(targets))[targets]
    of_runs, others = np.split(columns, [2 * of_run.shape[1]], axis=1)
    others = others - of_runs @ np.linalg.lstsq(of_runs, others, rcond=None)[0]
    tried, rest = others[:, :-1], others[:, -1]
    squares = np.sum(tried**2, axis=0)
    return np.asarray(rest @ rest - (tried.T @ rest) ** 2 / np.where(squares > 0.0, squares, np.inf))
