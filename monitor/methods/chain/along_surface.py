"""Touches that stand elsewhere on the surface than the same touches of the other runs.

A touch tells one number, along the normal of the surface. A reading that is wrong along the surface moves that number
by little on a flat face (half a millimetre times a tilt of 100 µrad: 0.05 µm) and by much on a curved one (half a
millimetre beside a radius of 10 mm: 12 µm), and in neither does its own run contradict it. The program of the runs
does: it sends the stylus to the same places again, or to places that the setting up of the piece has moved as a whole.

Use this beside ``gross``, which judges what a touch tells. Limits: at least three runs of the same plan; a shift that
all touches of a pose share is no mistake of one row.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.machine import evaluate
from monitor.methods.chain.deviation import (
    FEWEST_RUNS,
    LEAST_TIMES,
    MOST_PART,
    MOST_ROWS,
    Deviation,
    plan_touches,
)
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array

#: Median length of a plane vector of independent normal components over their standard deviation (Rayleigh's law).
RAYLEIGH_MEDIAN = 1.1774
#: A run is held against so many others, the nearest.
MOST_OTHERS = 4
#: Steps of the reweighted least squares of a motion: one wrong row of a hundred is without weight after a few.
STEPS = 20
#: A motion that changes no touch by more than this, in mm, is found: a touch is known to some 1e-4 mm.
STEADY = 1e-6
#: A pose of so many touches shows what its other touches have in common with one of them.
FEWEST_OF_POSE = 4


def along_surface(problem: ChainProblem) -> list[Deviation]:
    """The touches that are off along their surface; none for problems whose rows are not touches along a normal.

    The ``vector`` of each is the whole (3,) mm in the frame of the last work axis by which the tip stands elsewhere.
    """
    if problem.touch_normals is None or len(problem.runs) < FEWEST_RUNS:
        return []
    program = _Program(problem, problem.touch_normals)
    deviations: list[Deviation] = []
    for run_index in range(len(problem.runs)):
        rows, elsewhere = program.elsewhere(run_index)
        if len(rows) * MOST_PART < 1.0:
            continue
        length = np.linalg.norm(program.along(rows, elsewhere), axis=1)
        sigma = np.where(np.isfinite(problem.sigma[rows, 0]), problem.sigma[rows, 0], 0.0)
        limit = LEAST_TIMES * np.maximum(sigma, float(np.median(length)) / RAYLEIGH_MEDIAN)
        off = np.flatnonzero((length > limit) & (limit > 0.0))
        if len(off) <= min(MOST_ROWS, int(MOST_PART * len(rows))):
            deviations += [
                Deviation(int(rows[row]), tuple(map(float, elsewhere[row])), np.inf) for row in off.tolist()
            ]
    return deviations


@dataclass(frozen=True)
class _Program:
    """Where the touches of a problem stood, with the outward ``normals`` (n, 3) of their surfaces."""

    problem: ChainProblem
    normals: Array

    @cached_property
    def turning(self) -> list[int]:
        """The joints that turn: a linear axis that is read wrong is no other pose."""
        return [index for index, joint in enumerate(self.problem.context.chain.joints) if joint.turns]

    @cached_property
    def tips(self) -> Array:
        """Where the tip stands (n, 3) mm in the frame of the last work axis, by a machine without errors."""
        chain, positions = self.problem.context.chain, self.problem.context.positions
        none = np.zeros((len(positions), len(chain.joints), 2, 6))
        _, tip = self.problem.ends(self.problem.own_start)
        return np.asarray(evaluate(chain, positions, none, np.zeros((len(positions), 3)), tip).residual)

    @cached_property
    def poses(self) -> npt.NDArray[np.int64]:
        """A number (n,) for every pose."""
        angles = np.round(self.problem.context.positions[:, self.turning], 6) + 0.0
        return np.unique(angles, axis=0, return_inverse=True)[1].ravel().astype(np.int64)

    @cached_property
    def rows_of_touches(self) -> tuple[dict[int, int], ...]:
        """The row of every touch of the plan, run by run."""
        touches, run = plan_touches(self.problem, self.turning), self.problem.context.run
        return tuple(
            dict(zip(touches[run == number].tolist(), np.flatnonzero(run == number).tolist(), strict=True))
            for number in self.problem.runs
        )

    def elsewhere(self, run_index: int) -> tuple[npt.NDArray[np.int64], Array]:
        """The rows (m,) of a run that two other runs have too, and by how much each stands elsewhere, (m, 3) mm.

        Of the other runs that one counts beside which a row stands out in the middle, the lower of two: a wrong row of
        another run makes no right one wrong.
        """
        mine = self.rows_of_touches[run_index]
        others = sorted(
            set(range(len(self.problem.runs))) - {run_index}, key=lambda other: abs(other - run_index)
        )
        beside: dict[int, list[Array]] = {row: [] for row in mine.values()}
        for other in others[:MOST_OTHERS]:
            theirs = self.rows_of_touches[other]
            touches = [touch for touch in mine if touch in theirs]
            rows = np.array([mine[touch] for touch in touches], dtype=np.int64)
            others_rows = np.array([theirs[touch] for touch in touches], dtype=np.int64)
            if len(rows):
                for row, rest in zip(rows.tolist(), self._rest(rows, others_rows), strict=True):
                    beside[row].append(rest)
        middle = {
            row: sorted(
                rests, key=lambda rest: float(np.linalg.norm(self.along(np.array([row]), rest[None])))
            )
            for row, rests in beside.items()
            if len(rests) >= FEWEST_RUNS - 1
        }
        rows = np.array(sorted(middle), dtype=np.int64)
        return rows, np.array([middle[row][(len(middle[row]) - 1) // 2] for row in rows.tolist()]).reshape(
            -1, 3
        )

    def along(self, rows: npt.NDArray[np.int64], vectors: Array) -> Array:
        """The part of vectors (m, 3) along the surface of their rows."""
        normals = self.normals[rows]
        return np.asarray(vectors - np.sum(vectors * normals, axis=1, keepdims=True) * normals)

    def _rest(self, rows: npt.NDArray[np.int64], others_rows: npt.NDArray[np.int64]) -> Array:
        """By how much rows stand elsewhere than the same touches of another run, ``others_rows``: (m, 3) mm, once the
        piece may have been set up anew, and every pose be programmed anew."""
        rest = self.tips[rows] - self.tips[others_rows]
        x, y, z = (self.tips[rows] - self.tips[rows].mean(axis=0)).T
        zero = np.zeros_like(x)
        turns = np.stack(
            [np.stack([zero, -z, y], 1), np.stack([z, zero, -x], 1), np.stack([-y, x, zero], 1)], axis=2
        )
        shifts = np.eye(3)[None].repeat(len(rows), axis=0)
        rest = self._beside(rows, rest, np.concatenate([shifts, turns], axis=2))
        for pose in np.unique(self.poses[rows]):
            same = np.flatnonzero(self.poses[rows] == pose)
            if len(same) >= FEWEST_OF_POSE:
                rest[same] = self._beside(rows[same], rest[same], shifts[same])
        return rest

    def _beside(self, rows: npt.NDArray[np.int64], rest: Array, moves: Array) -> Array:
        """The rest (m, 3) without the one of the ``moves`` (m, 3, k) that leaves the least sum of lengths along the
        surfaces, to which a single wrong row does nothing. Across the surface the touch ends where that is."""
        normals = self.normals[rows]
        plane = np.eye(3) - normals[:, :, None] * normals[:, None, :]
        columns, values = plane @ moves, np.einsum("nij,nj->ni", plane, rest)
        weights, moved = np.ones(len(rows)), np.zeros_like(rest)
        for _ in range(STEPS):
            matrix = np.einsum("n,nik,nil->kl", weights, columns, columns)
            motion = np.linalg.pinv(matrix, rcond=1e-12, hermitian=True) @ np.einsum(
                "n,nik,ni->k", weights, columns, values
            )
            before, moved = moved, moves @ motion
            if float(np.max(np.abs(moved - before))) < STEADY:
                break
            length = np.linalg.norm(values - columns @ motion, axis=1)
            weights = 1.0 / np.maximum(length, 1e-3 * max(float(np.median(length)), 1e-6))
        return np.asarray(rest - moved)
