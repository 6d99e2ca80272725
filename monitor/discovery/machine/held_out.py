"""Error on readings that took no part in the fit: whole runs or days left out in turn, or blocks of poses of one run.

The base parameters are free in every run, so a run that was left out still finds its own; only the effects
that all runs share are predicted from the others. A single run with many poses is cut into blocks of
neighbouring poses, which are dealt out at random to ten parts; each part is predicted, base parameters included,
from the other nine.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.visible import Visible
from monitor.records import Array

PARTS = 10
# Neighbours in time share drifts and lags, so that blocks of them are left out; five blocks to a part.
BLOCKS = 50
# A tenth left out must not cost the base parameters anything to speak of.
READINGS_AN_UNKNOWN = 10
# Deals the blocks out; the held-out error moves by about a hundredth with another deal.
SEED = 20260302


def pose_parts(fit: Fit) -> npt.NDArray[np.int64] | None:
    """The part (M,) of every whitened number of a single run, -1 for calibrated quantities and padding.

    None where there are several runs or too few poses.
    """
    problem = fit.problem
    unknowns = int(fit.solution.rank.sum()) + len(fit.problem.added_names)
    if len(problem.runs) != 1 or fit.readings < READINGS_AN_UNKNOWN * unknowns:
        return None
    positions = problem.context.positions
    pose = np.concatenate([[0], np.cumsum(np.any(np.diff(positions, axis=0) != 0.0, axis=1))])
    poses = int(pose[-1]) + 1
    blocks = min(BLOCKS, poses)
    if blocks < 2 * PARTS:
        return None
    part = np.random.default_rng(SEED).permutation(np.arange(blocks) % PARTS)
    own = part[pose * blocks // poses]
    numbers = np.repeat(own, problem.sigma.shape[1])
    found = np.full(fit.solution.last.residual.size, -1, dtype=np.int64)
    found[: len(numbers)] = numbers
    return found


def held_out_error(fit: Fit, visible: Visible, columns: Array, fold: npt.NDArray[np.int64]) -> float | None:
    """Held-out root mean square in mm with ``columns`` (M, c) of shared effects; ``fold`` (R,) is that of every run.

    Runs are left out where there are two folds or more, blocks of poses where there is one run, None otherwise.
    """
    if len(fold) > 1:
        return held_out_rms(
            visible.residual, columns, fold[visible.run], visible.degrees_of_freedom, fit.sigma
        )
    parts = pose_parts(fit)
    if parts is None:
        return None
    # The run's own unknowns are no longer free where it was left out: they are columns like the others.
    whole = np.concatenate([fit.own.basis.reshape(len(visible.residual), -1), columns], axis=1)
    return fit.sigma * float(np.sqrt(held_out_sum(visible.residual, whole, parts) / fit.readings))


def held_out_sum(residual: Array, columns: Array, row_fold: npt.NDArray[np.int64]) -> float:
    """Sum of squares of whitened residuals (M,), each fold's with coefficients from all other folds.

    ``columns`` (M, c) are the projected columns of the shared effects, ``row_fold`` (M,) the fold of each row, -1
    where it is never left out.
    The residual may stem from any values of the coefficients: only differences matter.
    """
    if columns.shape[1] == 0:
        return float(residual @ residual)
    scale = np.linalg.norm(columns, axis=0)
    scaled = columns / np.where(scale == 0, 1.0, scale)
    folds = np.unique(row_fold)
    grams = np.array([scaled[row_fold == fold].T @ scaled[row_fold == fold] for fold in folds])
    ontos = np.array([scaled[row_fold == fold].T @ residual[row_fold == fold] for fold in folds])
    total = 0.0
    for place, fold in enumerate(folds):
        if fold < 0:
            continue
        gram = grams.sum(axis=0) - grams[place]
        onto = ontos.sum(axis=0) - ontos[place]
        coefficients = -np.linalg.pinv(gram, rcond=1e-10, hermitian=True) @ onto
        rows = row_fold == fold
        left = residual[rows] + scaled[rows] @ coefficients
        total += float(left @ left)
    return total


def held_out_rms(
    residual: Array, columns: Array, row_fold: npt.NDArray[np.int64], degrees_of_freedom: int, sigma: float
) -> float | None:
    """Held-out root mean square per degree of freedom in the unit of ``sigma``; None with fewer than two folds.

    ``degrees_of_freedom`` are those that the runs' own unknowns leave. Where the model is right the result
    estimates the standard uncertainty of a coordinate, the noise floor.
    """
    if len(np.unique(row_fold)) < 2:
        return None
    return sigma * float(np.sqrt(held_out_sum(residual, columns, row_fold) / degrees_of_freedom))
