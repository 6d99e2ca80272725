"""Control charts of one parameter: individuals (Shewhart), EWMA, CUSUM.

Individuals see a large jump at once, EWMA and CUSUM a small lasting one soon; EWMA forgives a single outlier
less than CUSUM. Every chart states its average run length to a false alarm, with the size of the reference
period allowed for: limits from 20 runs are wider than the textbook's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.charts.run_length import cusum_run_length, ewma_run_length, limit_for, run_length
from monitor.statistics.checks import as_vector
from monitor.statistics.monotone import lag_one

#: Run length of the three-sigma chart with known parameters, 1 / (2 (1 - Phi(3))).
THREE_SIGMA = 370.398
#: Mean moving range of two normal values in standard deviations, 2 / sqrt(pi).
D2 = 2.0 / float(np.sqrt(np.pi))


#: Added to the estimated correlation of neighbouring points, times the root of their number: a reference period of 8
#: to 30
#: points says little of it (measured rates: docs/trials-statistics.md). Beyond the highest one no level is claimed.
MARGIN, HIGHEST = 0.6, 0.9
#: Fewest points that a reference period of points that resemble each other counts for.
FEWEST_EFFECTIVE = 5


@dataclass(frozen=True)
class Reference:
    """Centre and scatter of a chart, in the unit of the values, from ``n`` runs (infinite: known).

    ``correlation`` of neighbouring points is allowed for: in ``n`` and ``dof``, which are those of as many independent
    points, in ``sd``, and in the limits of the charts that sum over points.
    """

    centre: float
    sd: float
    n: float
    dof: float
    correlation: float = 0.0

    def sd_of_weighted(self, lam: float) -> float:
        """Scatter that gives an EWMA of weight ``lam`` the variance it has with this correlation.

        Source: W. Schmid, Statistics & Probability Letters 31 (1997) 165, for the first-order process.
        """
        slow = self.correlation * (1.0 - lam)
        return self.sd * float(np.sqrt((1.0 + slow) / (1.0 - slow)))

    @property
    def sd_of_sums(self) -> float:
        """Scatter that gives sums over many points the variance they have with this correlation (R. A. Johnson and
        M. Bagshaw, Technometrics 16 (1974) 103)."""
        return self.sd * float(np.sqrt((1.0 + self.correlation) / (1.0 - self.correlation)))


def allowed_correlation(values: Array) -> float:
    """Correlation of neighbouring points of each column (n, p) or (n,), averaged, with a margin for what it may be
    off."""
    columns = values[:, np.newaxis] if values.ndim == 1 else values
    estimates = [lag_one(column, fitted=1) for column in columns.T]
    return float(np.clip(np.mean(estimates) + MARGIN / np.sqrt(len(columns)), 0.0, HIGHEST))


def effective_points(n: int, correlation: float) -> float:
    """Number of independent points whose mean is known as well as that of ``n`` with a correlation of neighbours."""
    lags = np.arange(1, n)
    return n / (1.0 + 2.0 * float(((1.0 - lags / n) * correlation**lags).sum()))


def correlated_reference(values: npt.ArrayLike) -> Reference:
    """Centre and scatter of a reference period (n,), at least 5 points, that may resemble their neighbours."""
    plain = reference_period(values)
    y = np.asarray(values, dtype=np.float64)
    correlation, n = allowed_correlation(y), len(y)
    effective = effective_points(n, correlation)
    # The scatter about a mean that follows the points is too small.
    sd = plain.sd / float(np.sqrt(max((1.0 - 1.0 / effective) * n / (n - 1.0), 0.25)))
    square = correlation**2
    dof = (n - 1.0) * (1.0 - square) / (1.0 + square)
    points = float(np.clip(np.floor(min(effective, dof + 1.0)), FEWEST_EFFECTIVE, n))
    return Reference(plain.centre, sd, points, points - 1.0, correlation)


@dataclass(frozen=True)
class ControlChart:
    """``statistic`` (n,) between ``lower`` and ``upper`` (n,), unit of the values; ``alarms`` are indices.

    ``limit`` is the multiplier of the standard deviation that gives the run length ``arl``.
    """

    kind: str
    reference: Reference
    statistic: Array
    lower: Array
    upper: Array
    limit: float
    arl: float
    alarms: npt.NDArray[np.int64]


@dataclass(frozen=True)
class CusumChart:
    """Upper and lower sums (n,) in the unit of the values, both counted positively, against ``limit``.

    ``started`` is the index after which the sum of the first alarm left zero: the best guess of when.
    """

    reference: Reference
    high: Array
    low: Array
    k: float
    h: float
    limit: float
    arl: float
    alarms: npt.NDArray[np.int64]
    started: int | None


def known_reference(centre: float, sd: float) -> Reference:
    """A centre and a scatter that are known, not estimated."""
    if not (np.isfinite(centre) and np.isfinite(sd) and sd > 0.0):
        raise DataError(f"centre is {centre}, sd is {sd}; a finite centre and sd above zero are needed.")
    return Reference(float(centre), float(sd), np.inf, np.inf)


def reference_period(values: npt.ArrayLike, *, by_moving_range: bool = False) -> Reference:
    """Centre and scatter of a reference period (n,), at least 5 runs: the standard deviation, or the moving range.

    The moving range ignores slow drift within the period; it has 0.62 (n - 1) effective degrees of freedom
    (D. J. Wheeler, Advanced Topics in Statistical Process Control, 1995, table 1, for large n).
    """
    y = as_vector(values, "values", least=5)
    n = len(y)
    if by_moving_range:
        sd, dof = float(np.abs(np.diff(y)).mean()) / D2, 0.62 * (n - 1.0)
    else:
        sd, dof = float(y.std(ddof=1)), n - 1.0
    if sd == 0.0:
        raise DataError(f"all {n} values of the reference period are {y[0]}; a chart needs their scatter.")
    return Reference(float(y.mean()), sd, float(n), dof)


def _wanted(arl: float) -> None:
    if not 2.0 < arl < 1e6:
        raise DataError(f"arl is {arl}; an average run length between 2 and a million is needed.")


def individuals_chart(
    values: npt.ArrayLike, reference: Reference, *, arl: float = THREE_SIGMA, limit: float | None = None
) -> ControlChart:
    """Shewhart chart of single values (n,): each new run has a false-alarm probability of 1 / arl.

    With an estimated reference the limits are prediction limits (Student's t, sqrt(1 + 1/n)). ``limit`` sets
    the multiplier instead, and ``arl`` is computed. Source: e-Handbook 6.3.2.2; G. J. Hahn and W. Q. Meeker,
    Statistical Intervals, 1991, 4.8.
    """
    y = as_vector(values, "values")
    _wanted(arl)
    swell = np.sqrt(1.0 + 1.0 / reference.n)
    if limit is None:
        limit = float(-scipy.special.stdtrit(reference.dof, 0.5 / arl) * swell)
    else:
        arl = float(0.5 / scipy.special.stdtr(reference.dof, -limit / swell))
    half = np.full(len(y), limit * reference.sd)
    alarms = np.flatnonzero(np.abs(y - reference.centre) > half)
    lower, upper = reference.centre - half, reference.centre + half
    return ControlChart("individuals", reference, y, lower, upper, limit, arl, alarms)


def ewma_chart(
    values: npt.ArrayLike,
    reference: Reference,
    *,
    lam: float = 0.2,
    arl: float = THREE_SIGMA,
    limit: float | None = None,
) -> ControlChart:
    """EWMA of ``values`` (n,) with weight ``lam``, started at the centre, and constant limits.

    ``limit`` sets the multiplier L instead, and ``arl`` is computed. Source: e-Handbook 6.3.2.4.
    """
    y = as_vector(values, "values")
    _wanted(arl)
    if not 0.0 < lam <= 1.0:
        raise DataError(f"lam is {lam}; the weight lies above 0 and up to 1.")
    chart = partial(ewma_run_length, lam=lam)
    if limit is None:
        limit = limit_for(chart, arl, reference.n, reference.dof, 12.0)
    else:
        arl = run_length(chart, limit, reference.n, reference.dof)
    path = np.empty(len(y))
    last = reference.centre
    for i, value in enumerate(y):
        last += lam * (value - last)
        path[i] = last
    half = np.full(len(y), limit * reference.sd_of_weighted(lam) * np.sqrt(lam / (2.0 - lam)))
    alarms = np.flatnonzero(np.abs(path - reference.centre) > half)
    lower, upper = reference.centre - half, reference.centre + half
    return ControlChart("EWMA", reference, path, lower, upper, limit, arl, alarms)


def cusum_chart(
    values: npt.ArrayLike,
    reference: Reference,
    *,
    k: float = 0.5,
    arl: float = THREE_SIGMA,
    h: float | None = None,
) -> CusumChart:
    """Two-sided tabular CUSUM of ``values`` (n,); ``k`` (half the shift to be seen) and ``h`` in sd.

    ``h`` sets the limit instead, and ``arl`` is computed. Source: e-Handbook 6.3.2.3.
    """
    y = as_vector(values, "values")
    _wanted(arl)
    if not 0.0 <= k < 5.0:
        raise DataError(
            f"k is {k}; half the shift to be seen, in standard deviations, from 0 to 5, is needed."
        )
    chart = partial(cusum_run_length, k=k)
    if h is None:
        h = limit_for(chart, arl, reference.n, reference.dof, 60.0)
    else:
        arl = run_length(chart, h, reference.n, reference.dof)
    high, low = np.empty(len(y)), np.empty(len(y))
    up = down = 0.0
    slack = k * reference.sd_of_sums
    for i, deviation in enumerate(y - reference.centre):
        up, down = max(0.0, up + deviation - slack), max(0.0, down - deviation - slack)
        high[i], low[i] = up, down
    limit = h * reference.sd_of_sums
    alarms = np.flatnonzero((high > limit) | (low > limit))
    started = None
    if alarms.size:
        side = high if high[alarms[0]] > limit else low
        zeros = np.flatnonzero(side[: alarms[0]] == 0.0)
        started = int(zeros[-1]) + 1 if zeros.size else 0
    return CusumChart(reference, high, low, k, h, limit, arl, alarms, started)
