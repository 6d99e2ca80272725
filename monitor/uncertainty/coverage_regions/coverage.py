"""Coverage factors and coverage probabilities for any number of outputs (JCGM 102:2011 6.5 and 7.7).

Which to use: ``ellipsoid_factor`` (k_p) for statements on all outputs together that respect their
correlation; ``rectangle_factor`` (k_q) for intervals y_j ± k_q u_j that all hold at once; ``single_factor``
(k) for one output alone. They assume normal outputs, or t with the given degrees of freedom.
``correlated_rectangle_factor`` is the k_q that the correlations allow, which is smaller; and
``joint_coverage`` says what "k = 2 each" really covers. Of Monte Carlo samples the factors are quantiles
(``quantile_of``) of ``mahalanobis_distances`` and ``largest_deviations`` (JCGM 102 7.7).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.uncertainty.roots import RANK_TOLERANCE, correlation_of, covariance_root, whitening

RectangleForm = Literal["bonferroni", "independent"]

#: Directions a scramble and independent scrambles of ``_reaches``: they leave standard errors of k_q near
#: 1e-4 for 2 outputs, 1.5e-3 for 13 and 4e-3 for 29 (measured, equal correlations of 0 to 0.9), in 0.1 s.
_DIRECTIONS = 4096
_SCRAMBLES = 8
#: Seed used where no generator is given, so that a certificate can be made again to the last digit.
_SEED = 102


@dataclass(frozen=True)
class Sampled:
    """A number found by sampling and the standard error of that finding."""

    value: float
    standard_error: float


def single_factor(p: float = 0.95, dof: float = math.inf) -> float:
    """Return k of one output, y ± k u: quantile of the normal or, with ``dof``, the t distribution (GUM G.3)."""
    return rectangle_factor(1, p, dof)


def ellipsoid_factor(outputs: int, p: float = 0.95, dof: float = math.inf) -> float:
    """Return k_p of the hyper-ellipsoid of ``outputs`` (the rank of U_y, not its order, where it is singular).

    Without ``dof`` the root of the chi-square quantile (JCGM 102:2011 6.5.2.3). With ``dof`` nu, the degrees
    of freedom of the estimated covariance, Hotelling's T²: k_p² = nu m / (nu - m + 1) F_p(m, nu - m + 1)
    (Anderson, Introduction to Multivariate Statistical Analysis, 5.2). With nu <= m - 1 the estimated
    covariance bounds nothing and the answer is infinity. Raises DataError for p outside (0, 1).
    """
    _check(outputs, p, dof)
    # The functions that scipy.stats takes its quantiles from: it needs half a second to load.
    if math.isinf(dof):
        return math.sqrt(float(2.0 * scipy.special.gammaincinv(0.5 * outputs, p)))
    rest = dof - outputs + 1.0
    if rest <= 0.0:
        return math.inf
    return math.sqrt(dof * outputs / rest * float(scipy.special.fdtri(outputs, rest, p)))


def rectangle_factor(
    outputs: int, p: float = 0.95, dof: float = math.inf, form: RectangleForm = "bonferroni"
) -> float:
    """Return k_q of the hyper-rectangle y_j ± k_q u_j over all ``outputs`` (JCGM 102:2011 6.5.4).

    ``bonferroni`` takes intervals of probability q = 1 - (1 - p)/m each: at least p together, whatever the
    correlation. ``independent`` takes q = p^(1/m): exactly p for independent normal outputs, at least p for
    correlated normal ones (Šidák 1967). Quantiles are of the normal or, with ``dof``, of the t distribution;
    for t outputs that share one estimate of the variance Šidák's bound holds too.
    """
    _check(outputs, p, dof)
    if form == "bonferroni":
        tail = (1.0 - p) / outputs
    elif form == "independent":
        tail = -math.expm1(math.log(p) / outputs)
    else:
        raise DataError(f"no form '{form}' of k_q; there are bonferroni and independent")
    if math.isinf(dof):
        return -float(scipy.special.ndtri(0.5 * tail))
    return -float(scipy.special.stdtrit(dof, 0.5 * tail))


def correlated_rectangle_factor(
    correlation: Array,
    p: float = 0.95,
    dof: float = math.inf,
    rng: np.random.Generator | None = None,
) -> Sampled:
    """Return k_q for normal (or multivariate t) outputs of this ``correlation`` (m, m), singular or not.

    The p-quantile of max|z_j|: the smallest factor that covers all outputs at once. The radius is integrated
    exactly, the directions by scrambled Sobol points (Deák 1980 with quasi-random directions).
    """
    outputs = len(np.atleast_2d(correlation))
    _check(outputs, p, dof)
    reaches, rank = _reaches(correlation, rng)
    upper = 2.0 * rectangle_factor(outputs, p, dof)
    coverages = [
        float(
            scipy.optimize.brentq(lambda k, r=part: float(np.mean(_radial(k / r, rank, dof))) - p, 0.0, upper)
        )
        for part in reaches
    ]
    return Sampled(float(np.mean(coverages)), float(np.std(coverages, ddof=1) / math.sqrt(len(coverages))))


def joint_coverage(
    correlation: Array, k: float = 2.0, dof: float = math.inf, rng: np.random.Generator | None = None
) -> Sampled:
    """The probability that all outputs of this ``correlation`` (m, m) lie within ``k`` u of their estimates.

    With k = 2 each: 91 % for 2 independent outputs, 55 % for 13. Method as ``correlated_rectangle_factor``.
    """
    if not k > 0.0:
        raise DataError(f"k must be positive, but is {k}")
    _check(len(np.atleast_2d(correlation)), 0.5, dof)
    reaches, rank = _reaches(correlation, rng)
    coverages = [float(np.mean(_radial(k / part, rank, dof))) for part in reaches]
    return Sampled(float(np.mean(coverages)), float(np.std(coverages, ddof=1) / math.sqrt(len(coverages))))


def mahalanobis_distances(
    outputs: Array, center: Array, covariance: Array, tolerance: float = RANK_TOLERANCE
) -> Array:
    """The distances (trials,) of ``outputs`` (trials, m) from ``center`` in the metric of ``covariance``."""
    white = (outputs - center) @ whitening(covariance, tolerance).T
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", white, white)))


def largest_deviations(outputs: Array, center: Array, covariance: Array) -> Array:
    """Return max_j |y_j - center_j| / u_j (trials,); outputs without variance take no part."""
    u = np.sqrt(np.diag(covariance))
    varies = u > 0.0
    if not np.any(varies):
        return np.zeros(len(outputs))
    return np.asarray(np.max(np.abs((outputs[:, varies] - center[varies]) / u[varies]), axis=1))


def quantile_of(values: Array, p: float) -> float:
    """The p-quantile of the discrete distribution of ``values``: the ceil(p n)-th smallest."""
    index = min(max(math.ceil(p * len(values) - 1e-9), 1), len(values)) - 1
    return float(np.partition(values, index)[index])


def quantile_standard_error(values: Array, p: float) -> float:
    """The standard error of ``quantile_of``: half the distance between the order statistics at ± 1 sigma.

    Their ranks differ from p n by the binomial standard deviation sqrt(n p (1 - p)), free of any assumption
    on the distribution.
    """
    ordered = np.sort(values)
    spread = math.sqrt(len(values) * p * (1.0 - p))
    low = min(max(math.floor(p * len(values) - spread), 0), len(values) - 1)
    high = min(math.ceil(p * len(values) + spread), len(values) - 1)
    return 0.5 * float(ordered[high] - ordered[low])


def _check(outputs: int, p: float, dof: float) -> None:
    if outputs < 1:
        raise DataError(f"the number of outputs must be at least 1, but is {outputs}")
    if not 0.0 < p < 1.0:
        raise DataError(f"the coverage probability p must lie between 0 and 1, but is {p}")
    if not dof > 0.0:
        raise DataError(f"degrees of freedom must be positive, but are {dof}")


def _reaches(correlation: Array, rng: np.random.Generator | None) -> tuple[list[Array], int]:
    """max_j |a_j · d| over unit directions d (directions,), once a scramble, and the rank.

    ``a_j`` are the rows of the correlation's root; P(max|z| <= k) is the mean over d of P(radius <= k/reach).
    """
    root = covariance_root(correlation_of(np.atleast_2d(correlation)))
    generator = np.random.default_rng(_SEED) if rng is None else rng
    reaches = []
    for _ in range(_SCRAMBLES):
        points = scipy.stats.qmc.Sobol(root.rank, scramble=True, rng=generator).random(_DIRECTIONS)
        normal = scipy.stats.norm.ppf(np.clip(points, 1e-15, 1.0 - 1e-15))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        reaches.append(np.max(np.abs(normal @ root.root.T), axis=1))
    return reaches, root.rank


def _radial(radius: Array, rank: int, dof: float) -> Array:
    """P(R <= radius) for the length R of a standard normal (or t) vector in ``rank`` dimensions."""
    if math.isinf(dof):
        return np.asarray(scipy.stats.chi2.cdf(radius**2, rank))
    return np.asarray(scipy.stats.f.cdf(radius**2 / rank, rank, dof))
