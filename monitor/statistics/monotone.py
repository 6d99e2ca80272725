"""Mann-Kendall test for a monotone trend with autocorrelation allowed for.

Plain Mann-Kendall takes neighbours that resemble each other for a trend: with a lag-1 correlation of 0.5 it
raises a false alarm in a quarter of trend-free series of 60. The variance of its S is corrected here by the
effective number of values of a first-order process. Its correlation is estimated from the ranks without the
Theil-Sen trend and corrected for bias; since few values tell little of it, one standard deviation is added.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_vector

#: Standard deviation of the estimated correlation times the root of the number of values: simulated 1.33 for 10 values,
#: 1.2 for 20 (Bartlett's first order, J. R. Stat. Soc. Suppl. 8 (1946) 27, says at most 1).
SCATTER = 1.25


@dataclass(frozen=True)
class MonotoneTrend:
    """``s`` counts rising less falling pairs; ``autocorrelation`` is that of lag 1, 0 where none is seen.

    ``p_value`` allows for it and its uncertainty, ``p_value_independent`` does not; ``inflation`` is the factor on
    the variance.
    """

    s: int
    tau: float
    autocorrelation: float
    inflation: float
    p_value: float
    p_value_independent: float


def lag_one(residual: Array, *, fitted: int) -> float:
    """Lag-1 autocorrelation (n,) -> scalar, corrected for the bias of ``fitted`` estimated coefficients.

    The correction adds (fitted + (fitted + 2) r) / n to first order (Kendall 1954 for a mean: (1 + 4 r)/n
    with the divisor n; Marriott and Pope, Biometrika 41 (1954) 390).
    """
    n = len(residual)
    centred = residual - residual.mean()
    square = float(centred @ centred)
    if square == 0.0:
        return 0.0
    r = float(centred[1:] @ centred[:-1]) / square
    return float(np.clip(r + (fitted + (fitted + 3) * r) / n, -0.95, 0.95))


def pairs(values: Array, times: Array) -> tuple[Array, Array]:
    """Rise (m,) and slope (m,) of every pair of different times, the later less the earlier; times must not fall."""
    earlier, later = _places(len(values))
    rise, apart = values[later] - values[earlier], times[later] - times[earlier]
    if not (apart > 0.0).all():
        rise, apart = rise[apart > 0.0], apart[apart > 0.0]
    return rise, rise / apart


# The parameters of a machine have the same number of days.
@lru_cache(maxsize=8)
def _places(n: int) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    earlier, later = np.triu_indices(n, 1)
    return earlier, later


def theil_sen(
    values: Array,
    times: Array,
    level: float,
    pair_slopes: tuple[Array, Array] | None = None,
    inflation: float = 1.0,
) -> tuple[float, tuple[float, float]]:
    """Median slope of all pairs of ``values`` (n,) over ``times`` (n,), which must not fall, and its interval.

    Source: P. K. Sen, J. Am. Stat. Assoc. 63 (1968) 1379, Eq. (2.6) with its variance for ties; the numbers are those
    of ``scipy.stats.theilslopes``, of which only the ranks that are asked for are sorted out. ``pair_slopes``: the
    ``pairs``, where they were computed before; ``inflation``: of the variance of Mann-Kendall's S by autocorrelation.
    """
    n = len(values)
    slopes = (pair_slopes or pairs(values, times))[1]
    many = len(slopes)
    variance = n * (n - 1.0) * (2 * n + 5) / 18.0
    for column in (values, times):
        k = np.unique(column, return_counts=True)[1].astype(np.float64)
        variance -= float((k * (k - 1) * (2 * k + 5)).sum()) / 18.0
    half = float(scipy.special.ndtri(0.5 * (1.0 + level)) * np.sqrt(max(variance * inflation, 0.0)))
    low, high = max(round((many - half) / 2.0) - 1, 0), min(round((many + half) / 2.0), many - 1)
    middle = ((many - 1) // 2, many // 2)
    slopes = np.partition(slopes, sorted({low, high, *middle}))
    median = 0.5 * (float(slopes[middle[0]]) + float(slopes[middle[1]]))
    return median, (float(slopes[low]), float(slopes[high]))


def mann_kendall(
    values: npt.ArrayLike,
    times: npt.ArrayLike,
    *,
    pair_slopes: tuple[Array, Array] | None = None,
    slope: float | None = None,
) -> MonotoneTrend:
    """Mann-Kendall of ``values`` (n,) in the order of ``times`` (n,), which must rise; at least 6 values.

    ``pair_slopes`` and ``slope``: the ``pairs`` and their median, where they were computed before.
    Ties are corrected for. Raises ``DataError`` for fewer values, times that do not rise or non-finite
    numbers. Sources: M. G. Kendall, Rank Correlation Methods, 1975; K. H. Hamed and A. R. Rao, J. Hydrology
    204 (1998) 182, for ranks of the detrended series; S. Yue and C. Wang, Water Resour. Manage. 18 (2004)
    201, for the first-order variance. Measured false alarms at 5 %: at most 5 % for correlations up to 0.6 from
    10 values on (independent values: 2 to 3 %); 7 to 8 % with 0.8 and up to 20 values, which cannot be
    distinguished from a trend (docs/trials-statistics.md).
    """
    y = as_vector(values, "values", least=6)
    n = len(y)
    t = as_vector(times, "times", length=n)
    if (np.diff(t) <= 0.0).any():
        raise DataError(
            f"times falls or repeats at index {int(np.argmax(np.diff(t) <= 0)) + 1}; it must rise."
        )
    rise, slopes = pair_slopes or pairs(y, t)
    s = int(np.count_nonzero(rise > 0.0) - np.count_nonzero(rise < 0.0))
    ties = np.unique(y, return_counts=True)[1].astype(np.float64)
    variance = (n * (n - 1.0) * (2 * n + 5) - (ties * (ties - 1) * (2 * ties + 5)).sum()) / 18.0
    if variance == 0.0:
        return MonotoneTrend(0, 0.0, 0.0, 1.0, 1.0, 1.0)
    slope = float(np.median(slopes)) if slope is None else slope
    ranks = _ranks(y - slope * t)
    lag_correlation = lag_one(np.asarray(ranks), fitted=2)
    r = float(np.clip(lag_correlation + SCATTER / np.sqrt(n), 0.0, 0.95))
    lags = np.arange(1, n)
    inflation = 1.0 + 2.0 * float(((1.0 - lags / n) * r**lags).sum())
    tau = s / (n * (n - 1) / 2.0)
    plain, allowed = (_p_value(s, v) for v in (variance, variance * inflation))
    return MonotoneTrend(s, tau, max(lag_correlation, 0.0), inflation, allowed, plain)


def _ranks(values: Array) -> Array:
    """Ranks (n,) from 1; ties share the mean of theirs."""
    _, index, counts = np.unique(values, return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(counts) - 0.5 * (counts - 1))[index])


def _p_value(s: int, variance: float) -> float:
    """Two-sided normal p-value with the continuity correction."""
    return float(2.0 * scipy.special.ndtr(-max(abs(s) - 1, 0) / np.sqrt(variance)))
