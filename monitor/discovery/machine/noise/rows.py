"""How the numbers of a run follow each other: which are neighbours, and in which directions.

A drift of a machine is a vector: between tool and work along X, Y and Z. Rows of three numbers show all of it. A touch
shows one of the three; its neighbour is the touch before it in the same direction, however many of other directions
stand between, and a face that is touched from the other side shows the same drift with the other sign.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from monitor.machine import MOTION
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array

# A step from row to row of one pose, of a step from pose to pose: rows of nothing but shared noise stay different.
WITHIN_A_POSE = 0.02

ScalarT = TypeVar("ScalarT", bound=np.generic)


@dataclass(frozen=True)
class Rows:
    """The layout of whitened numbers (R, N): ``weighted`` (R, T) touches of d numbers each, ``turned`` (R, T, d, d)
    into the directions of the readings (None where they are the readings); what stands behind is no reading.

    ``order`` (R, T) sorts touches by the direction that they show, and within it by time: so sorted each follows its
    neighbour, ``steps`` (R, T) touches after it. None: the order of measuring, one by one.

    ``begins`` (R, T), in the order of neighbours, marks touches that have none before them: those of another instrument
    or direction. ``read`` (R, T) is how many of the d numbers there are. None: one instrument, all numbers.
    """

    weighted: npt.NDArray[np.bool_]
    numbers: int
    turned: Array | None
    begins: npt.NDArray[np.bool_] | None = None
    read: Array | None = None
    order: npt.NDArray[np.int64] | None = None
    steps: Array | None = None

    @property
    def count(self) -> int:
        """How many of the N numbers are of readings."""
        return int(self.weighted.shape[1]) * self.numbers

    def by_neighbours(
        self, touches: npt.NDArray[ScalarT], runs: npt.NDArray[np.int64] | None = None
    ) -> npt.NDArray[ScalarT]:
        """What stands by touch (R, T, ...) in the order of neighbours; ``runs`` (R,) are those that it is of."""
        if self.order is None:
            return touches
        order = self.order if runs is None else self.order[runs]
        return touches[np.arange(len(touches))[:, None], order]

    def correlated(self, index: int, rho: float, share: float) -> Array:
        """The correlations (T, T) of the touches of the run at ``index``, in the order of measuring: those of one
        series resemble each other by ``share`` times ``rho`` to the power of the steps between them."""
        count = self.weighted.shape[1]
        steps = np.ones(count) if self.steps is None else self.steps[index]
        along = np.cumsum(steps)
        matrix = share * rho ** np.abs(along[:, None] - along)
        if self.begins is not None:
            series = np.cumsum(self.begins[index])
            matrix[series[:, None] != series] = 0.0
        np.fill_diagonal(matrix, 1.0)
        if self.order is None:
            return np.asarray(matrix)
        back = np.argsort(self.order[index])
        return np.asarray(matrix[back[:, None], back])


def rows_of(problem: ChainProblem) -> Rows:
    """The layout of the whitened numbers of a problem, in the order of measuring."""
    is_number, numbers = problem.is_number, problem.sigma.shape[1]
    # Rows of several instruments differ in how many numbers they have: what a kind does not have is not lacking.
    weighted = np.isfinite(problem.sigma) | ~is_number
    runs = len(problem.runs)
    padded = problem.padded(weighted.astype(float)).reshape(runs, -1, numbers)
    is_weighted = np.all(padded > 0.5, axis=-1)
    series = problem.series
    if is_number.all() and not np.ptp(series):
        return Rows(is_weighted, numbers, None)
    read = problem.padded(is_number.astype(float)).reshape(runs, -1, numbers).sum(axis=2)
    of_touch = problem.padded(series[:, None].astype(float) + 1.0).reshape(runs, -1)
    begins = np.diff(of_touch, axis=1, prepend=0.0) != 0.0
    return Rows(is_weighted, numbers, None, begins, read * is_weighted)


def turned_into_readings(problem: ChainProblem, by_error: Array) -> Array | None:
    """Rotations (R, T, d, d) of a row's numbers into the directions of the measured joints; None where the numbers are
    no vectors of as many joints."""
    if len(problem.measured_joints) != 3 or problem.sigma.shape[1] != 3:
        return None
    moved = _directions(problem, by_error)
    # Directions are at right angles but for errors of microradians.
    turned = problem.padded(np.swapaxes(moved, 1, 2).reshape(len(moved), -1)[:, :, None])
    return turned.reshape(len(problem.runs), -1, 3, 3)


def neighbours_of(problem: ChainProblem, by_error: Array) -> Rows:
    """The layout of the whitened numbers of a problem, with the direction in which each row shows a drift."""
    rows = rows_of(problem)
    if rows.numbers != 1 or rows.begins is not None or len(problem.measured_joints) < 2:
        return replace(rows, turned=turned_into_readings(problem, by_error))
    shown = problem.padded(_directions(problem, by_error)).reshape(*rows.weighted.shape, -1)
    axis = np.argmax(np.abs(shown), axis=2)
    order = np.argsort(axis, axis=1, kind="stable")
    by_axis = np.take_along_axis(axis, order, axis=1)
    new = np.diff(by_axis, axis=1, prepend=-1) != 0
    steps = np.where(new, 1, np.diff(order, axis=1, prepend=0))
    sign = np.where(np.take_along_axis(shown, axis[..., None], axis=2) < 0.0, -1.0, 1.0)
    return replace(rows, turned=sign[..., None], begins=new, order=order, steps=steps.astype(np.float64))


def along_axes(problem: ChainProblem, by_error: Array, rows: Rows) -> list[Rows]:
    """The same rows of directions, two numbers each, turned so that the first is what a rotary axis moves, for each
    axis; none where rows are no directions.

    Seeing and refraction go to the side and up, guiding and drives along the axes of an equatorial mount. Between them
    turns the parallactic angle, and what follows itself in one frame seems independent in the other.
    """
    if rows.numbers != 2 or rows.order is not None or problem.measured_joints:
        return []
    chain = problem.context.chain
    turned = []
    for index, joint in enumerate(chain.joints):
        if not joint.turns:
            continue
        moved = problem.observe(by_error[:, :, index, MOTION, 3 + joint.main])
        length = np.linalg.norm(moved, axis=1, keepdims=True)
        # A direction along the axis is not moved by it, and any is as good.
        first = np.where(length > 1e-6 * length.max(), moved, (1.0, 0.0))
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        both = np.stack([first, np.stack([-first[:, 1], first[:, 0]], axis=1)], axis=1)
        by_run = problem.padded(both.reshape(len(both), 4)[:, :, None])
        turned.append(replace(rows, turned=by_run.reshape(*rows.weighted.shape, 2, 2)))
    return turned


def from_pose_to_pose(rows: Rows, pose: npt.NDArray[np.int64]) -> Rows:
    """Rows that follow each other from ``pose`` (M,) of every whitened number to pose."""
    of_touch = pose.reshape(len(rows.weighted), -1)[:, : rows.count : rows.numbers]
    stays = np.diff(rows.by_neighbours(of_touch), axis=1, prepend=-2) == 0
    steps = np.ones(stays.shape) if rows.steps is None else rows.steps
    return replace(rows, steps=np.where(stays, WITHIN_A_POSE, steps))


def _directions(problem: ChainProblem, by_error: Array) -> Array:
    """What a unit of each measured joint makes of the number of every row (n, 1, joints)."""
    chain, measured = problem.context.chain, list(problem.measured_joints)
    along = np.array([chain.joints[index].direction for index in measured])
    return problem.observe(np.einsum("nrac,ac->nra", by_error[:, :, measured, MOTION, :3], along))
