"""The readings of a chain that are left out in turn: whole runs or days, or blocks of poses of one run.

The base parameters are free in every run, so a run that was left out still finds its own; only the effects
that all runs share are predicted from the others. Runs of one plan share its poses, and an effect that mimics
another one does so in every run; poses that are left out of all runs show it. A single run with many poses is cut
into blocks of neighbouring poses, which are dealt out at random to ten parts; each part is predicted, base
parameters included, from the other nine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.fit import Fit
from monitor.discovery.search.projection import inverse_above, orthonormal, without
from monitor.records import Array

PARTS = 10
# Neighbours in time share drifts and lags, so that blocks of them are left out; five blocks to a part.
BLOCKS = 50
# A tenth left out must not cost the base parameters anything to speak of.
READINGS_AN_UNKNOWN = 10
# Deals the blocks out; the held-out error moves by about a hundredth with another deal.
SEED = 20260302
# Fewer poses than this cannot do without a tenth of them.
FEWEST_POSES = 8
# A direction of which the rows that stay determine less than this part is not predicted.
PREDICTED = 1e-2


def pose_parts(fit: Fit) -> npt.NDArray[np.int64] | None:
    """The part (M,) of every whitened number of a single run, -1 for calibrated quantities and padding.

    None where there are several runs or too few poses.
    """
    problem = fit.problem
    unknowns = int(fit.solution.rank.sum()) + len(fit.problem.added_names)
    if len(problem.runs) != 1 or fit.readings < READINGS_AN_UNKNOWN * unknowns:
        return None
    parts = pose_blocks(fit)
    return None if parts.max() < 0 else parts


def pose_blocks(fit: Fit) -> npt.NDArray[np.int64]:
    """The part (M,) of every whitened number, where blocks of neighbouring poses are dealt out to ten parts: -1 for
    calibrated quantities and padding, and for all numbers where there are too few poses."""
    pose = poses_of(fit)
    poses = int(pose[-1]) + 1
    blocks = min(BLOCKS, poses)
    if blocks < 2 * PARTS:
        return np.full(fit.solution.last.residual.size, -1, dtype=np.int64)
    part = np.random.default_rng(SEED).permutation(np.arange(blocks) % PARTS)
    return of_numbers(fit, part[pose * blocks // poses])


class LeftOutBlocks:
    """Blocks of poses of a single run left out in turn, its own unknowns determined without them each time.

    ``basis`` (M, p) is the orthonormal span of the run's own unknowns, ``parts`` (M,) the part of every number, -1 for
    those never left out. What the own unknowns take of each part is worked out once (by bordering the normal equations:
    Cook and Weisberg, Residuals and influence in regression, 1982, section 2.2).
    """

    def __init__(self, basis: Array, parts: npt.NDArray[np.int64]) -> None:
        self._rows = [np.flatnonzero(parts == part) for part in range(int(parts.max()) + 1)]
        self._own = [basis[rows] for rows in self._rows]
        self._inverse = [
            np.linalg.pinv(
                np.eye(basis.shape[1]) - basis_of_fold.T @ basis_of_fold, rcond=1e-10, hermitian=True
            )
            for basis_of_fold in self._own
        ]

    def sum_of_squares(self, residual: Array, columns: Array) -> float:
        """Sum of squares of the parts, each predicted from the others with ``columns`` (M, c) of effects beside the own
        unknowns; residual (M,) and columns are free of these. Directions that the other parts hardly determine are not
        predicted."""
        columns = orthonormal(columns)
        onto = columns.T @ residual
        normals, parts = [], []
        for rows, basis_of_fold, inverse in zip(self._rows, self._own, self._inverse, strict=True):
            part, left_out = columns[rows], residual[rows]
            mixed, alone = -basis_of_fold.T @ part, -basis_of_fold.T @ left_out
            reaction = inverse @ mixed
            normals.append(np.eye(columns.shape[1]) - part.T @ part - mixed.T @ reaction)
            wanted = onto - part.T @ left_out - reaction.T @ alone
            parts.append((part, left_out, wanted, inverse @ alone, reaction))
        total = 0.0
        inverses = inverse_above(np.array(normals), PREDICTED)
        for (part, left_out, wanted, alone, reaction), basis_of_fold, inverse in zip(
            parts, self._own, inverses, strict=True
        ):
            sizes = inverse @ wanted
            error = left_out - part @ sizes - basis_of_fold @ (alone - reaction @ sizes)
            total += float(error @ error)
        return total


def poses_of(fit: Fit) -> npt.NDArray[np.int64]:
    """The pose (n,) of every row: rows of one run after another at which no axis moved."""
    context = fit.problem.context
    moved = np.any(np.diff(context.positions, axis=0) != 0.0, axis=1) | (np.diff(context.run) != 0)
    return np.concatenate([[0], np.cumsum(moved)])


def of_numbers(fit: Fit, rows: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Labels (n,) of rows as those (M,) of their whitened numbers, -1 for calibrated quantities and padding."""
    problem = fit.problem
    numbers = np.repeat(rows + 1.0, problem.sigma.shape[1]).reshape(problem.sigma.shape)
    padded = problem.padded(numbers).astype(np.int64) - 1
    labels = np.full(fit.solution.last.residual.shape, -1, dtype=np.int64)
    labels[:, : padded.shape[1]] = padded
    return labels.reshape(-1)


@dataclass(frozen=True)
class PoseFold:
    """Numbers of some poses in every run that are left out together: ``rows`` (R, m) of each run, those ``present``
    (R, m), and the orthonormal ``directions`` (R, m, k) in which the own unknowns of a run move them. A residual of the
    whole fit grows along each by so many times itself, ``growth`` (R, k), when they are determined without these rows.
    """

    rows: npt.NDArray[np.int64]
    present: npt.NDArray[np.bool_]
    directions: Array
    growth: Array

    def predicted(self, residual: Array) -> Array:
        """What residuals (R, m, k) of the whole fit become without these rows."""
        along = np.swapaxes(self.directions, 1, 2) @ residual
        return np.asarray(
            self.present[..., None] * residual + self.directions @ (self.growth[..., None] * along)
        )

    @cached_property
    def count(self) -> int:
        """The count of numbers that are predicted."""
        return int(np.count_nonzero(self.present))


@lru_cache(maxsize=2)
def pose_folds(fit: Fit) -> tuple[PoseFold, ...]:
    """The poses of a plan dealt out to ten folds; empty where there are too few poses."""
    problem = fit.problem
    context = problem.context
    measured = problem.measured_joints
    posed = [joint for joint in range(len(context.chain.joints)) if joint not in measured]
    _, pose = np.unique(np.round(context.positions[:, posed], 6) + 0.0, axis=0, return_inverse=True)
    poses = int(pose.max()) + 1
    if poses < FEWEST_POSES:
        return ()
    # Blocks of neighbouring poses, where there are hundreds: neighbours share drifts and lags.
    part = np.random.default_rng(SEED).permutation(np.arange(poses) % min(PARTS, poses))
    numbers = problem.sigma.shape[1]
    rows = np.repeat(part[pose.reshape(-1)] + 1.0, numbers).reshape(-1, numbers)
    fold = problem.padded(np.where(np.isfinite(problem.sigma), rows, 0.0))
    basis = fit.nuisance.basis
    folds = []
    for number in range(1, int(fold.max()) + 1):
        inside = [np.flatnonzero(of_run == number) for of_run in fold]
        most = max(len(members) for members in inside)
        taken = np.zeros((len(fold), most), dtype=np.int64)
        present = np.zeros((len(fold), most), dtype=bool)
        for run, members in enumerate(inside):
            taken[run, : len(members)], present[run, : len(members)] = members, True
        basis_rows = np.where(present[..., None], np.take_along_axis(basis, taken[..., None], axis=1), 0.0)
        # Of hundreds of rows the few unknowns of a run move few directions.
        directions, taken_along, _ = np.linalg.svd(basis_rows, full_matrices=False)
        values = 1.0 - taken_along**2
        # What only the rows left out determine (a ball touched once) nothing predicts.
        inverse = np.where(values > PREDICTED, 1.0 / np.where(values > PREDICTED, values, 1.0), 0.0)
        folds.append(PoseFold(taken, present, directions, inverse - 1.0))
    return tuple(folds)


def held_out_by_poses(residual: Array, columns: Array, folds: Sequence[PoseFold]) -> float | None:
    """Root mean square of whitened residuals (R, N) of poses that took no part in the fit of ``columns`` (R N, c), nor
    in that of the runs' own unknowns; None where nothing can be left out.

    Left-out residuals follow from those of the whole fit by its hat matrix (Cook and Weisberg, Residuals and influence
    in regression, 1982, section 2.2).
    """
    basis = orthonormal(columns)
    remainder = without(basis, residual.reshape(-1, 1)).reshape(residual.shape)
    shared = basis.reshape(*residual.shape, -1)
    number = sum(fold.count for fold in folds)
    if not number:
        return None
    grams, ontos, parts = [], [], []
    runs = np.arange(len(residual))[:, None]
    for fold in folds:
        left_out, shared_rows = remainder[runs, fold.rows], shared[runs, fold.rows]
        reaction = fold.predicted(shared_rows).reshape(left_out.size, -1)
        grams.append(np.eye(shared_rows.shape[2]) - shared_rows.reshape(left_out.size, -1).T @ reaction)
        ontos.append(reaction.T @ left_out.reshape(-1))
        parts.append((fold.predicted(left_out[..., None]).reshape(-1), reaction))
    inverses = inverse_above(np.array(grams), PREDICTED)
    shares = (inverses @ np.array(ontos)[..., None])[..., 0]
    errors = [alone + reaction @ share for (alone, reaction), share in zip(parts, shares, strict=True)]
    return float(np.sqrt(sum(float(error @ error) for error in errors) / number))
