"""Projection of a matrix to the nearest correlation matrix, for matrices read from print."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.exceptions import DataError
from monitor.records import Array


@dataclass(frozen=True)
class Projection:
    """The nearest correlation matrix (n, n), how far its entries moved at most, and what was wrong before."""

    matrix: Array
    largest_change: float
    smallest_eigenvalue: float


def nearest_correlation(matrix: Array, *, tolerance: float = 1e-10, steps: int = 1000) -> Projection:
    """The positive semidefinite correlation matrix nearest to ``matrix`` (n, n) in the Frobenius norm.

    Higham 2002: alternating projections with Dykstra's correction. A matrix printed with two decimals needs
    this before use. Raises DataError for a matrix that is not symmetric, or when the steps do not suffice.
    """
    original = np.asarray(matrix, dtype=np.float64)
    if (
        original.ndim != 2
        or original.shape[0] != original.shape[1]
        or not np.allclose(original, original.T, atol=1e-9)
    ):
        raise DataError(
            f"a correlation matrix must be square and symmetric; this one has shape {original.shape}"
        )
    smallest = float(np.linalg.eigvalsh(original)[0])
    current, correction = original.copy(), np.zeros_like(original)
    np.fill_diagonal(current, 1.0)
    for _ in range(steps):
        shifted = current - correction
        values, vectors = np.linalg.eigh(shifted)
        semidefinite = (vectors * np.maximum(values, 0.0)) @ vectors.T
        correction = semidefinite - shifted
        previous, current = current, 0.5 * (semidefinite + semidefinite.T)
        np.fill_diagonal(current, 1.0)
        if np.max(np.abs(current - previous)) < tolerance:
            break
    else:
        raise DataError(f"the projection to a correlation matrix did not settle in {steps} steps")
    values, vectors = np.linalg.eigh(current)
    current = (vectors * np.maximum(values, 0.0)) @ vectors.T
    scale = np.sqrt(np.diag(current))
    current = current / np.outer(scale, scale)
    np.fill_diagonal(current, 1.0)
    return Projection(current, float(np.max(np.abs(current - original))), smallest)
