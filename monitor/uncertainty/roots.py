"""Square roots of covariance matrices, singular ones included.

With fewer runs than coordinates a covariance has a rank below its order; drawing from it and measuring
distances in it is done inside that rank, found by an eigen-decomposition, never by adding noise to the
diagonal. The decomposition is that of the correlation matrix, so units that differ by powers of ten do not
decide what counts as zero. Where the matrix is positive definite ``whitening`` uses Cholesky's factor, as
JCGM 102:2011 7.7 does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from monitor.exceptions import DataError
from monitor.records import Array

#: An eigenvalue of the correlation matrix below this part of the largest counts as zero: rounding leaves
#: about order * 2.2e-16, which for 1000 inputs is 2e-13; readings with a resolution of 1e-3 of their scatter
#: leave about 1e-7.
RANK_TOLERANCE = 1e-12


@dataclass(frozen=True)
class CovarianceRoot:
    """``root @ root.T`` is the covariance; ``root`` has shape (n, rank).

    ``whitener`` (rank, n) takes deviations to ``rank`` uncorrelated ones of unit variance; ``eigenvalues``
    (n,), ascending, are those of the correlation matrix.
    """

    root: Array
    whitener: Array
    eigenvalues: Array

    @property
    def rank(self) -> int:
        """The number of independent directions."""
        return int(self.root.shape[1])


def covariance_root(covariance: Array, tolerance: float = RANK_TOLERANCE) -> CovarianceRoot:
    """The root and the whitener of a covariance (n, n) by eigen-decomposition, in its rank.

    Raises DataError for a matrix that is not a covariance: not square or symmetric, not finite, a negative
    variance or an eigenvalue of its correlation matrix below ``-max(tolerance, 1e-9)`` times the largest.
    """
    covariance = checked_covariance(covariance)
    scale = np.sqrt(np.diag(covariance))
    safe = np.where(scale > 0.0, scale, 1.0)
    values, vectors = scipy.linalg.eigh(covariance / np.outer(safe, safe))
    largest = max(float(values[-1]), 0.0) if len(values) else 0.0
    if len(values) and values[0] < -max(tolerance, 1e-9) * max(largest, 1e-300):
        raise DataError(
            f"the covariance matrix is not positive semidefinite: its correlation matrix has the eigenvalue "
            f"{values[0]:.3g}, and none may be negative"
        )
    significant = values > tolerance * largest
    lengths = np.sqrt(values[significant])
    basis = vectors[:, significant]
    return CovarianceRoot(
        root=np.ascontiguousarray(safe[:, None] * basis * lengths),
        whitener=np.ascontiguousarray((basis / lengths).T / safe),
        eigenvalues=values,
    )


def whitening(covariance: Array, tolerance: float = RANK_TOLERANCE) -> Array:
    """The whitener (rank, n) of a covariance: Cholesky's where it exists (JCGM 102 7.7), else in its rank."""
    covariance = checked_covariance(covariance)
    scale = np.sqrt(np.diag(covariance))
    if np.all(scale > 0.0):
        correlation = covariance / np.outer(scale, scale)
        try:
            factor = np.linalg.cholesky(correlation)
        except np.linalg.LinAlgError:
            return covariance_root(covariance, tolerance).whitener
        # The squared pivots bound the smallest eigenvalue from above: small ones ask for the rank.
        if float(np.min(np.diag(factor))) ** 2 > 1e3 * tolerance * len(scale):
            inverse = scipy.linalg.solve_triangular(factor, np.eye(len(scale)), lower=True)
            return np.asarray(inverse / scale)
    return covariance_root(covariance, tolerance).whitener


def checked_covariance(covariance: Array) -> Array:
    """The matrix (n, n) made exactly symmetric; raises DataError where it cannot be a covariance."""
    matrix = np.asarray(covariance, dtype=np.float64)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise DataError(f"a covariance matrix must be square, but this one has shape {matrix.shape}")
    if not np.all(np.isfinite(matrix)):
        raise DataError("a covariance matrix must be finite, but this one has infinite or missing entries")
    variances = np.diag(matrix)
    if np.any(variances < 0.0):
        worst = int(np.argmin(variances))
        raise DataError(f"variances must not be negative, but number {worst + 1} is {variances[worst]:.6g}")
    scale = np.sqrt(np.outer(variances, variances))
    if np.any(np.abs(matrix - matrix.T) > 1e-8 * scale + 1e-300):
        raise DataError("a covariance matrix must be symmetric, but this one is not")
    return np.asarray(0.5 * (matrix + matrix.T))


def correlation_of(covariance: Array) -> Array:
    """The correlation matrix (n, n); a quantity without variance is uncorrelated with all others."""
    covariance = checked_covariance(covariance)
    scale = np.sqrt(np.diag(covariance))
    safe = np.where(scale > 0.0, scale, 1.0)
    correlation = np.asarray(covariance / np.outer(safe, safe))
    np.fill_diagonal(correlation, 1.0)
    return correlation


class WithCovariance:
    """What follows from the ``covariance`` (m, m) of a result's outputs."""

    covariance: Array

    @property
    def u(self) -> Array:
        """Standard uncertainties (m,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def correlation(self) -> Array:
        """Correlation matrix (m, m)."""
        return correlation_of(self.covariance)

    @property
    def lambda_max(self) -> float:
        """The largest eigenvalue of the correlation matrix."""
        return float(np.linalg.eigvalsh(self.correlation)[-1])
