"""Stein's estimator of the eigenvalues of a covariance that was estimated from few repetitions.

The eigenvalues of a sample covariance spread more than those of what it estimates: the large ones come out too large,
the small ones too small, the more so the fewer degrees of freedom there are for each dimension.
"""

from __future__ import annotations

import numpy as np

from monitor.records import Array

#: Eigenvalues nearer to one another than this part count as apart by it: their places are exchanged by pooling anyway.
_APART = 1e-9


def stein_eigenvalues(eigenvalues: Array, dof: float) -> Array:
    """Return the eigenvalues (..., a), positive and not rising, of a matrix of which Wishart's matrix was drawn.

    ``eigenvalues`` (..., a) are those of the Wishart matrix divided by anything, not rising; ``dof`` its degrees of
    freedom, above a - 1. Each is divided by ``dof - a + 1 + 2 sum_j l_i/(l_i - l_j)``, and neighbours that this puts
    out of order are pooled (Stein 1975; Lin and Perlman, Multivariate Analysis VI (1985) 411, section 2).
    """
    values = np.atleast_2d(np.asarray(eigenvalues, dtype=np.float64))
    count = values.shape[-1]
    if count == 1:
        return np.asarray(eigenvalues) / dof
    apart = values[:, :, None] - values[:, None, :]
    least = _APART * np.maximum(values[:, :, None], values[:, None, :])
    sign = np.sign(np.arange(count)[None, :] - np.arange(count)[:, None])
    apart = np.where(np.abs(apart) < least, sign * least, apart)
    np.einsum("nii->ni", apart)[:] = np.inf
    divisors = dof - count + 1.0 + 2.0 * np.sum(values[:, :, None] / apart, axis=-1)
    corrected = values / divisors
    upset = np.any(divisors <= 0.0, axis=1)
    upset |= np.any(values[:, 1:] * divisors[:, :-1] > values[:, :-1] * divisors[:, 1:], axis=1)
    for row in np.flatnonzero(upset):
        corrected[row] = _pooled(values[row], divisors[row])
    return np.asarray(corrected.reshape(np.shape(eigenvalues)))


def _pooled(values: Array, divisors: Array) -> Array:
    """Quotients of ``values`` and ``divisors`` (a,), neighbours taken together until all are positive and in order."""
    blocks: list[tuple[float, float, int]] = []
    for value, divisor in zip(values.tolist(), divisors.tolist(), strict=True):
        size = 1
        while blocks and (
            divisor <= 0.0 or blocks[-1][1] <= 0.0 or value * blocks[-1][1] > blocks[-1][0] * divisor
        ):
            before = blocks.pop()
            value, divisor, size = value + before[0], divisor + before[1], size + before[2]
        blocks.append((value, divisor, size))
    return np.concatenate([np.full(size, value / divisor) for value, divisor, size in blocks])
