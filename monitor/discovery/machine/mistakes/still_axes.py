"""Columns of axes that stand still in the whole file while the readings say that the axes moved.

A log that lost a channel repeats its last value. Of an axis that is kept still, as Y and Z are while a laser looks
along X, the column says the same, and nothing is wrong. So it is asked only where no machine of the file fits: whether
the readings fit where the axis stood somewhere else in each row, each of which then has one number less to tell.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.mistakes.cures import CURED_TIMES, Maker, Mistake, problem_with
from monitor.exceptions import MonitorError
from monitor.machine import MOTION
from monitor.methods.chain.least_squares import RANK_TOLERANCE, Linearisation
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array, Campaign

#: Angles that are tried for each pose, and how often a frame is guessed anew with those that fit best.
ANGLES, GUESSES = 24, 6
#: Steps of a fit with the axis free, of which the last is shorter than this many standard uncertainties.
MOST_STEPS, SHORT = 15, 1e-3
#: So much of all numbers is left over where the axis is free and the unknowns are fitted.
LEAST_LEFT = 0.3
#: mm over which an axis moved; an angle is the same where its unit vectors have a mean of this length.
MOVED, AT_ONE_ANGLE = 1.0, 0.999
#: Columns that are tried.
MOST_TRIED = 4


def find_still_axes(campaign: Campaign, problem_of: Maker) -> tuple[Mistake, ...]:
    """The mistake that the column of an axis stood still while the axis moved, of readings that as recorded fit no
    machine. Empty where no axis stands still in all rows, or where the readings do not fit with it free either."""
    problem = problem_with(campaign, problem_of)
    if problem is None or len(problem.common_start):
        return ()
    readings = campaign.probings.readings
    joints = problem.context.chain.joints
    still = [
        (index, joint.name)
        for index, joint in enumerate(joints)
        if joint.kind != "spindle" and joint.name in readings and np.ptp(readings[joint.name]) == 0.0
    ]
    mistakes = []
    for index, axis in still[:MOST_TRIED]:
        try:
            with np.errstate(all="ignore"):
                rms = _rms_with_free(campaign, problem_of, index, axis)
        except (MonitorError, np.linalg.LinAlgError):
            continue
        if rms is not None:
            column = f"{axis.lower()}_{'mm' if campaign.machine.is_linear(axis) else 'deg'}"
            what = f"{column} stood still in all rows while {axis} moved (undone: {axis} free in each row)"
            mistakes.append(Mistake(what, float("inf"), rms))
    return tuple(sorted(mistakes, key=lambda mistake: mistake.rms_undone))


def _rms_with_free(campaign: Campaign, problem_of: Maker, joint: int, axis: str) -> float | None:
    """What is left in mm with one joint free in each row; None where that is more than effects leave."""
    problem = problem_of(campaign)
    if problem.context.chain.joints[joint].turns:
        problem = _with_best_angles(campaign, problem_of, joint, axis)
    local, rank = problem.start, 0
    for _ in range(MOST_STEPS):
        residual, by_local, motion = _rows(problem, local, joint)
        step, rank, size = _step(problem, local, _across(residual, motion), _across(by_local, motion))
        run = np.searchsorted(problem.runs, problem.context.run)
        ahead = residual + np.einsum("ndp,np->nd", by_local, step[run])
        length = np.sum(motion**2, axis=1)
        shift = np.einsum("nd,nd->n", motion, ahead) / np.where(length > 0.0, length, 1.0)
        local, problem = local + step, _at(problem, joint, problem.context.positions[:, joint] - shift)
        if size < SHORT:
            break
    is_number = np.isfinite(problem.sigma)
    numbers = int(is_number.sum())
    spare = numbers - rank - len(problem.context)
    rms = float(np.sqrt(np.mean(problem.vectors(local, problem.common_start)[is_number] ** 2)))
    sigma = float(np.sqrt(np.mean(problem.sigma[is_number] ** 2)))
    fits = spare > LEAST_LEFT * numbers and rms < CURED_TIMES * sigma
    return rms if fits and _has_moved(problem, joint, motion) else None


def _has_moved(problem: ChainProblem, joint: int, motion: Array) -> bool:
    """Whether a joint that is free stands at different positions in the rows that it moves (n, d): a wrist that is
    turned over, which the sign of the next joint does as well, stands at one."""
    positions = problem.context.positions[np.any(motion != 0.0, axis=1), joint]
    if problem.context.chain.joints[joint].turns:
        return bool(np.abs(np.mean(np.exp(1j * positions))) < AT_ONE_ANGLE)
    return bool(np.std(positions) > MOVED)


def _at(problem: ChainProblem, joint: int, positions: Array) -> ChainProblem:
    """The problem with a joint at other positions (n,)."""
    moved = problem.context.positions.copy()
    moved[:, joint] = positions
    return replace(problem, context=replace(problem.context, positions=moved))


def _rows(problem: ChainProblem, local: Array, joint: int) -> tuple[Array, Array, Array]:
    """The whitened residuals (n, d), their derivatives (n, d, p), and those by the position of a joint (n, d)."""
    residual, by_local, _ = problem.of_rows(local, problem.common_start)
    pose = problem.evaluated(local, problem.common_start, jacobian=True)
    assert pose.by_error is not None
    turns = problem.context.chain.joints[joint].turns
    parts = slice(3, 6) if turns else slice(0, 3)
    along = np.array(problem.context.chain.joints[joint].direction)
    motion = problem.observe(pose.by_error[:, :, joint, MOTION, parts] @ along) / problem.sigma
    return residual, by_local, np.nan_to_num(motion)


def _across(numbers: Array, motion: Array) -> Array:
    """Numbers (n, d, ...) less what a motion (n, d) of their row does."""
    length = np.linalg.norm(motion, axis=1, keepdims=True)
    unit = motion / np.where(length > 0.0, length, 1.0)
    return np.asarray(numbers - np.einsum("nd,n...->nd...", unit, np.einsum("nd,nd...->n...", unit, numbers)))


def _step(problem: ChainProblem, local: Array, residual: Array, by_local: Array) -> tuple[Array, int, float]:
    """The step (R, p) of a fit, the rank of all runs, and how far it moves the whitened numbers."""
    none = np.zeros((*residual.shape, 0))
    at = problem.with_calibrated(Linearisation(*map(problem.padded, (residual, by_local, none))), local)
    steps, rank, moved = [], 0, 0.0
    for rest, columns in zip(at.residual, at.local, strict=True):
        size = np.linalg.norm(columns, axis=0)
        size = np.where(size > 0.0, size, 1.0)
        step, _, of_run, _ = np.linalg.lstsq(columns / size, -rest, rcond=RANK_TOLERANCE)
        steps.append(step / size)
        rank += int(of_run)
        moved += float(np.sum((columns / size @ step) ** 2))
    return np.array(steps), rank, float(np.sqrt(moved / max(rank, 1)))


def _with_best_angles(campaign: Campaign, problem_of: Maker, joint: int, axis: str) -> ChainProblem:
    """The problem with a rotary joint where each pose fits best, and first guesses made anew with that."""
    problem = problem_of(campaign)
    pose, sign = _poses(problem), problem.context.chain.joints[joint].sign
    angles = np.linspace(-np.pi, np.pi, ANGLES, endpoint=False)
    for _ in range(GUESSES):
        squares = np.zeros((len(angles), int(pose.max()) + 1))
        for number, angle in enumerate(angles):
            turned = _at(problem, joint, np.full(len(pose), angle))
            white = turned.vectors(problem.start, problem.common_start) / problem.sigma
            np.add.at(squares[number], pose, np.sum(white**2, axis=1))
        best = angles[np.argmin(squares, axis=0)][pose]
        if np.array_equal(best, problem.context.positions[:, joint]):
            break
        probings = campaign.probings
        readings = {**probings.readings, axis: sign * best}
        problem = problem_of(replace(campaign, probings=replace(probings, readings=readings)))
    return problem


def _poses(problem: ChainProblem) -> npt.NDArray[np.int64]:
    """The number (n,) of the pose of each row: rows that follow each other with all joints alike."""
    context = problem.context
    state = np.column_stack([context.run, context.positions])
    return np.concatenate([[0], np.cumsum(np.any(np.diff(state, axis=0) != 0.0, axis=1))])
