"""Control charts of the vector of all parameters: Hotelling's T² and MEWMA.

They see a change that no single parameter shows, along a direction in which the machine usually does not
move. T² for large changes at once, MEWMA for small lasting ones. The reference period needs more runs than
parameters; better three times as many.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.charts.chart_limits import tabulated_vector_limit
from monitor.statistics.charts.control import THREE_SIGMA, allowed_correlation, effective_points
from monitor.statistics.checks import as_matrix

#: Steps of the simulated charts that are held at a time: 2000 trials of 20 parameters take 16 MB.
_STEPS = 50


@dataclass(frozen=True)
class VectorChart:
    """``statistic`` (n,), dimensionless, against ``limit``; ``alarms`` are indices.

    ``shares`` (n, p) is what the statistic loses when a parameter is left out: who raised the alarm.
    """

    kind: str
    statistic: Array
    limit: float
    arl: float
    alarms: npt.NDArray[np.int64]
    shares: Array


def _reference(
    values: npt.ArrayLike, reference: npt.ArrayLike, correlated: bool
) -> tuple[Array, Array, int, float]:
    """Values standardised by the reference (n, p), the inverse covariance of what is standardised, and its points; and
    the correlation of neighbouring points that is allowed for, of which the covariance is freed."""
    x, reference_runs = as_matrix(values, "values", least=1), as_matrix(reference, "reference")
    m, p = reference_runs.shape
    if x.shape[1] != p:
        raise DataError(f"values has {x.shape[1]} parameters, reference {p}; the same are needed.")
    if m < p + 2:
        raise DataError(f"the reference period has {m} runs for {p} parameters; at least {p + 2} are needed.")
    scale = reference_runs.std(axis=0, ddof=1)
    if (scale == 0.0).any():
        raise DataError(f"column {int(np.argmin(scale))} never varies in the reference period; leave it out.")
    correlation = np.cov(reference_runs / scale, rowvar=False).reshape(p, p)
    if np.linalg.eigvalsh(correlation)[0] < 1e-10:
        raise DataError("the reference period has columns that are exactly dependent; leave one out.")
    neighbours = allowed_correlation(reference_runs) if correlated else 0.0
    effective = effective_points(m, neighbours)
    # The scatter about means that follow the points is too small, and the means are less well known.
    swell = (1.0 + 1.0 / effective) / (1.0 + 1.0 / m) / max((1.0 - 1.0 / effective) * m / (m - 1.0), 0.25)
    inverse = np.linalg.inv(correlation) / swell
    return (x - reference_runs.mean(axis=0)) / scale, inverse, m, neighbours


#: A limit needs so many points more than parameters.
POINTS_BEYOND_PARAMETERS = 4


def _points_of(m: int, p: int, correlation: float) -> float:
    """Points that a reference of ``m`` with a correlation of neighbours counts for in the limit of T².

    Half-way from m to those that know a variance as well, (m - 1) (1 - r²) / (1 + r²) + 1 (M. S. Bartlett, J. R. Stat.
    Soc. Suppl. 8 (1946) 27): alarms come in clusters, so that all of the way would leave next to none
    (docs/trials-statistics.md).
    """
    square = correlation**2
    effective = (m - 1.0) * (1.0 - square) / (1.0 + square) + 1.0
    return min(float(m), max(0.5 * (m + effective), p + POINTS_BEYOND_PARAMETERS))


def _quadratic(z: Array, inverse: Array) -> tuple[Array, Array]:
    """Quadratic form (n,) and what it loses without each parameter (n, p)."""
    turned = z @ inverse
    return np.asarray((turned * z).sum(axis=1)), turned**2 / np.diag(inverse)


#: Share of the logarithm by which fewer points widen the limit of T² that widens the limit of MEWMA: a path of many
#: points averages some of it. Chosen with seed 1 of 0, 1/4, 1/2 and 1: with 0 a chart of ten and fifteen parameters
#: whose points correlate by 0.8 alarms in 53 and 68 % instead of 39 % (docs/trials-statistics.md).
OF_MEWMA = 0.25


def _t_squared_limit(m: float, p: int, arl: float) -> float:
    """Limit of T² of new runs about a reference of ``m`` points."""
    factor = p * (m + 1.0) * (m - 1.0) / (m * (m - p))
    return float(factor * scipy.special.fdtri(p, m - p, 1.0 - 1.0 / arl))


def t_squared_chart(
    values: npt.ArrayLike, reference: npt.ArrayLike, *, arl: float = THREE_SIGMA, correlated: bool = False
) -> VectorChart:
    """T² of ``values`` (n, p) about a ``reference`` period (m, p), in any units; 1 / arl alarms a run.

    The limit is exact for new runs: p (m + 1) (m - 1) / (m (m - p)) F. Raises ``DataError`` unless
    m >= p + 2. ``correlated``: neighbouring points may resemble each other, and the reference period then counts for
    fewer points (``_points_of``). Source: N. D. Tracy, J. C. Young and R. L.
    Mason, J. Qual. Technol. 24 (1992) 88.
    """
    z, inverse, runs, neighbours = _reference(values, reference, correlated)
    p = z.shape[1]
    _wanted(arl)
    statistic, shares = _quadratic(z, inverse)
    m = _points_of(runs, p, neighbours)
    limit = _t_squared_limit(m, p, arl)
    return VectorChart("T²", statistic, limit, arl, np.flatnonzero(statistic > limit), shares)


def mewma_chart(
    values: npt.ArrayLike,
    reference: npt.ArrayLike,
    *,
    rng: np.random.Generator,
    lam: float = 0.2,
    arl: float = 200.0,
    trials: int = 2000,
    correlated: bool = False,
) -> VectorChart:
    """MEWMA of ``values`` (n, p) about a ``reference`` period (m, p), in any units, started at its mean.

    The limit is simulated with reference periods of the same size: a chance of 1 - 1/e of a false alarm
    within ``arl`` runs (``correlated``: with what neighbours may resemble each other allowed for), as for an
    exponential run length; with 2000 trials the run length is good to 4 %.
    Where ``chart_limits`` holds the limit, from 20 000 trials, that one is taken and ``rng`` and ``trials`` are not
    used.
    Source: C. A. Lowry et al., Technometrics 34 (1992) 46.
    """
    z, inverse, m, neighbours = _reference(values, reference, correlated)
    _wanted(arl)
    if not 0.0 < lam <= 1.0:
        raise DataError(f"lam is {lam}; the weight lies above 0 and up to 1.")
    if trials < 100:
        raise DataError(f"trials is {trials}; at least 100 are needed.")
    tabulated = tabulated_vector_limit(z.shape[1], m, lam, arl)
    limit = mewma_limit(z.shape[1], m, lam, arl, rng, trials) if tabulated is None else tabulated
    if neighbours > 0.0:
        p = z.shape[1]
        points = _points_of(m, p, neighbours)
        limit *= (_t_squared_limit(points, p, arl) / _t_squared_limit(m, p, arl)) ** OF_MEWMA
    path = np.empty_like(z)
    last = np.zeros(z.shape[1])
    for i, row in enumerate(z):
        last = last + lam * (row - last)
        path[i] = last
    slow = neighbours * (1.0 - lam)
    statistic, shares = _quadratic(path, inverse * (2.0 - lam) / lam * (1.0 - slow) / (1.0 + slow))
    return VectorChart("MEWMA", statistic, limit, arl, np.flatnonzero(statistic > limit), shares)


def mewma_limit(
    p: int, m: float, lam: float, arl: float, rng: np.random.Generator, trials: int = 2000
) -> float:
    """The limit of a MEWMA of ``p`` parameters about a reference of ``m`` runs (infinite: known)."""
    if np.isinf(m):
        mean, inverse = np.zeros((trials, p)), np.broadcast_to(np.eye(p), (trials, p, p))
    else:
        mean = rng.standard_normal((trials, p)) / np.sqrt(m)
        runs = int(m) - 1
        covariance = np.empty((trials, p, p))
        for i in range(trials):
            rows = rng.standard_normal((runs, p))
            covariance[i] = rows.T @ rows / runs
        inverse = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
    largest = np.zeros(trials)
    last = np.zeros((trials, p))
    # Steps are taken by the block: one product of matrices a trial costs a tenth of as many products with a vector.
    for steps_to_go in range(round(arl), 0, -_STEPS):
        path = rng.standard_normal((min(steps_to_go, _STEPS), trials, p)) - mean
        for row in path:
            last += lam * (row - last)
            row[:] = last
        by_trial = path.transpose(1, 0, 2)
        squares = np.einsum("tsp,tsp->ts", by_trial @ inverse, by_trial)
        np.maximum(largest, squares.max(axis=1), out=largest)
    return float(np.quantile(largest, np.exp(-1.0)) * (2.0 - lam) / lam)


def _wanted(arl: float) -> None:
    if not 2.0 < arl < 1e5:
        raise DataError(f"arl is {arl}; an average run length between 2 and 100 000 is needed.")
