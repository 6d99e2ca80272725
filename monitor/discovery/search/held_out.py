"""Error on rows that took no part in the fit: folds of them left out in turn."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from monitor.discovery.search.projection import inverse_above
from monitor.records import Array

#: Rows are dealt into ten folds at random, always the same way.
FOLDS, DEAL = 10, 20261121
#: What the other folds show of a direction of columns of length 1, at least; less is rounding.
DETERMINED = 1e-10


def folds_of(count: int) -> npt.NDArray[np.int64]:
    """The fold (n,) of every row; below twenty rows each is one."""
    if count < 2 * FOLDS:
        return np.arange(count)
    return np.random.default_rng(DEAL).permutation(count) % FOLDS


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
    folds, index = np.unique(row_fold, return_inverse=True)
    members = [np.flatnonzero(index == fold) for fold in range(len(folds))]
    grams = np.array([scaled[rows].T @ scaled[rows] for rows in members])
    ontos = np.array([scaled[rows].T @ residual[rows] for rows in members])
    inverses = inverse_above(grams.sum(axis=0) - grams, DETERMINED)
    coefficients = -(inverses @ (ontos.sum(axis=0) - ontos)[..., None])[..., 0]
    remainder = residual + np.einsum("mc,mc->m", scaled, coefficients[index])
    return float(np.sum(remainder[row_fold >= 0] ** 2))


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
