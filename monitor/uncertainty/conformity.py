"""Probability that parameters lie within their tolerances, one by one and all together (JCGM 106:2012 clause 7).

The knowledge of the outputs is a joint normal distribution, or a multivariate t where their covariance has few
degrees of freedom; its density outside the limits is the probability of being out of tolerance. The joint
probability uses the correlations: the product of the single ones would be wrong by as much as they correlate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array

#: Points a scramble and independent scrambles: they leave a standard error of the joint probability below 2e-4
#: for 13 and 30 outputs (measured, correlations 0 to 0.9, probabilities 0.05 to 0.95), in 30 ms.
_POINTS = 2048
_SCRAMBLES = 8
#: Seed used where no generator is given, so that a certificate can be made again to the last digit.
_SEED = 106
#: Added to the diagonal of a correlation matrix whose rank is not full; smaller than any number printed.
_JITTER = 1e-10


@dataclass(frozen=True)
class Conformity:
    """Probabilities of conformity: ``single`` (m,) of every output, ``joint`` of all, and its standard error."""

    single: Array
    joint: float
    joint_standard_error: float


def conformity(
    estimate: npt.ArrayLike,
    covariance: npt.ArrayLike,
    lower: npt.ArrayLike,
    upper: npt.ArrayLike,
    *,
    dof: npt.ArrayLike = math.inf,
    rng: np.random.Generator | None = None,
) -> Conformity:
    """Probabilities that outputs (m,) with ``covariance`` (m, m) lie between ``lower`` and ``upper`` (m,).

    All in one consistent set of units; an open side is an infinite limit. ``dof`` of each variance (m,), or one for
    all: the t distribution instead of the normal, for the joint probability that of the fewest. ``single`` is JCGM
    106:2012 7.2 and 7.3, ``joint`` its integral over all limits, by Genz's separation of variables (J. Comput. Graph.
    Statist. 1 (1992) 141; for t Genz and Bretz 2002) on scrambled Sobol points. Raises DataError for shapes that
    differ, limits that do not rise, variances that are not positive.
    """
    y = np.asarray(estimate, dtype=np.float64)
    u_y = np.asarray(covariance, dtype=np.float64)
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    count = len(y)
    if u_y.shape != (count, count) or low.shape != (count,) or high.shape != (count,) or count == 0:
        raise DataError(
            f"{count} outputs need a covariance ({count}, {count}) and as many limits, not {u_y.shape}, {low.shape} "
            f"and {high.shape}"
        )
    if not (low < high).all():
        raise DataError("a lower limit must lie below its upper limit")
    variance = np.diag(u_y)
    if not (np.isfinite(y).all() and np.isfinite(u_y).all() and (variance > 0.0).all()):
        raise DataError("estimates must be finite and variances positive")
    freedoms = np.broadcast_to(np.asarray(dof, dtype=np.float64), y.shape)
    if not (freedoms > 0.0).all():
        raise DataError(f"degrees of freedom must be positive, but the fewest are {freedoms.min():g}")
    u = np.sqrt(variance)
    a, b = (low - y) / u, (high - y) / u
    single = _below(b, freedoms) - _below(a, freedoms)
    bounded = np.isfinite(a) | np.isfinite(b)
    if not bounded.any():
        return Conformity(single, 1.0, 0.0)
    if bounded.sum() == 1:
        return Conformity(single, float(single[bounded][0]), 0.0)
    correlation = (u_y / np.outer(u, u))[np.ix_(bounded, bounded)]
    probability = _box(
        correlation,
        a[bounded],
        b[bounded],
        float(freedoms[bounded].min()),
        rng or np.random.default_rng(_SEED),
    )
    # The least probable limit bounds the joint probability whatever the sampling left open.
    joint = min(float(np.mean(probability)), float(single.min()))
    return Conformity(
        single, max(joint, 0.0), float(np.std(probability, ddof=1) / math.sqrt(len(probability)))
    )


def _below(values: Array, freedoms: Array) -> Array:
    """Probabilities (m,) that Student's t, or a normal number, is below ``values`` (m,)."""
    infinite = np.isinf(freedoms)
    student = scipy.special.stdtr(np.where(infinite, 1.0, freedoms), values)
    return np.asarray(np.where(infinite, scipy.special.ndtr(values), student))


def _box(correlation: Array, a: Array, b: Array, dof: float, rng: np.random.Generator) -> list[float]:
    """The probability of the box between ``a`` and ``b`` (m,), found once by every scramble."""
    # The narrowest limits first: the later factors then vary least.
    order = np.argsort(scipy.special.ndtr(b) - scipy.special.ndtr(a), kind="stable")
    matrix = correlation[np.ix_(order, order)] + _JITTER * np.eye(len(order))
    root = np.linalg.cholesky(matrix)
    low, high = a[order], b[order]
    count = len(order)
    finite = math.isfinite(dof)
    estimates = []
    for _ in range(_SCRAMBLES):
        points = scipy.stats.qmc.Sobol(count - 1 + finite, scramble=True, rng=rng).random(_POINTS)
        points = np.clip(points, 1e-15, 1.0 - 1e-15)
        scale = np.sqrt(scipy.stats.chi2.ppf(points[:, -1], dof) / dof) if finite else np.ones(_POINTS)
        drawn = np.zeros((_POINTS, count))
        inside = np.ones(_POINTS)
        for index in range(count):
            before = drawn[:, :index] @ root[index, :index]
            d = scipy.special.ndtr((low[index] * scale - before) / root[index, index])
            e = scipy.special.ndtr((high[index] * scale - before) / root[index, index])
            inside *= e - d
            if index < count - 1:
                drawn[:, index] = scipy.special.ndtri(
                    np.clip(d + points[:, index] * (e - d), 1e-300, 1.0 - 1e-16)
                )
        estimates.append(float(inside.mean()))
    return estimates
