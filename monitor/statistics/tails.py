"""Upper tails of the distributions of test statistics, and their quantiles.

They are the functions of ``scipy.special`` that ``scipy.stats`` itself evaluates, without its half a second of loading:
a command that reads must not wait for a hundred distributions. Arguments broadcast. Degrees of freedom that are not
positive give NaN, as in ``scipy.stats``, a statistic below zero (by rounding) the probability 1.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import scipy

from monitor.records import Array


def chi_square_tail(statistic: npt.ArrayLike, dof: npt.ArrayLike) -> Array:
    """Return P(chi² > ``statistic``) with ``dof`` degrees of freedom."""
    return np.asarray(scipy.special.chdtrc(_positive(dof), np.maximum(statistic, 0.0)))


def chi_square_quantile(tail: npt.ArrayLike, dof: npt.ArrayLike) -> Array:
    """Return the chi² that is exceeded with probability ``tail``."""
    return np.asarray(scipy.special.chdtri(_positive(dof), tail))


def f_tail(statistic: npt.ArrayLike, dof1: npt.ArrayLike, dof2: npt.ArrayLike) -> Array:
    """Return P(F > ``statistic``) with ``dof1`` and ``dof2`` degrees of freedom."""
    return np.asarray(scipy.special.fdtrc(_positive(dof1), _positive(dof2), np.maximum(statistic, 0.0)))


def f_quantile(tail: npt.ArrayLike, dof1: npt.ArrayLike, dof2: npt.ArrayLike) -> Array:
    """Return the F that is exceeded with probability ``tail``."""
    return np.asarray(scipy.special.fdtri(_positive(dof1), _positive(dof2), 1.0 - np.asarray(tail)))


def student_tail(statistic: npt.ArrayLike, dof: npt.ArrayLike) -> Array:
    """Return P(t > ``statistic``) with ``dof`` degrees of freedom."""
    return np.asarray(scipy.special.stdtr(_positive(dof), np.negative(statistic)))


def mean_ranks(values: Array) -> Array:
    """Return the ranks from 1 within each column of ``values`` (n, p), the mean of them where values are equal."""
    ranks = np.empty(values.shape)
    for column, of_column in zip(values.T, ranks.T, strict=True):
        _, index, counts = np.unique(column, return_inverse=True, return_counts=True)
        of_column[:] = (np.cumsum(counts) - 0.5 * (counts - 1))[index]
    return ranks


def _positive(dof: npt.ArrayLike) -> Array:
    freedom = np.asarray(dof, dtype=float)
    return np.where(freedom > 0.0, freedom, np.nan)
