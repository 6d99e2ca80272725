"""Drift of one parameter over runs, campaigns and years: a weighted slope, a robust one, a monotone test.

The weighted slope uses each run's own uncertainty and a between-day component; believe it where the three
agree. Where only the weighted one says drift, look for an outlier or a step (``changes``) first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_positive, as_probability, as_vector
from monitor.statistics.mixed import MixedFit, fit_with_days
from monitor.statistics.monotone import MonotoneTrend, mann_kendall, pairs, theil_sen
from monitor.statistics.sums import label_groups


@dataclass(frozen=True)
class Trend:
    """A straight line ``level_at + slope (t - at)``; slopes in the unit of the values per unit of the times.

    ``at`` is the mean time, ``covariance`` (2, 2) that of level and slope, ``dof`` the degrees of freedom of
    the slope; ``between`` the day component and ``within`` the factor on the runs' own uncertainties (their
    standard deviation where none were given). ``robust_interval`` and ``monotone`` are None below 6 days,
    where ranks cannot reach their level; ``monotone`` also where two days have one mean time.
    """

    at: float
    level_at: float
    slope: float
    u_slope: float
    slope_interval: tuple[float, float]
    dof: float
    p_value: float
    covariance: Array
    within: float
    between: float
    run_sd: float
    n: int
    days: int
    confidence: float
    robust_slope: float
    robust_interval: tuple[float, float] | None
    monotone: MonotoneTrend | None


def day_averages(
    values: Array, times: Array, u: Array | None, index: npt.NDArray[np.intp]
) -> tuple[Array, Array]:
    """Weighted means of values and times by day, in the order of time."""
    weight = np.ones_like(values) if u is None else 1.0 / u**2
    total = np.bincount(index, weight)
    y, t = np.bincount(index, weight * values) / total, np.bincount(index, weight * times) / total
    order = np.argsort(t, kind="stable")
    return y[order], t[order]


def _result(
    fit: MixedFit, at: float, y: Array, u: Array | None, days: tuple[Array, Array], p: float, robust: bool
) -> Trend:
    means, moments = days
    ranked = robust and len(means) >= 6
    slope, interval, monotone = np.nan, None, None
    if robust:
        both = pairs(means, moments)
        slope, interval = theil_sen(means, moments, p, both)
        if ranked and (np.diff(moments) > 0.0).all():
            monotone = mann_kendall(means, moments, pair_slopes=both, slope=slope)
    low, high = fit.interval(p)[1]
    run_u = 1.0 if u is None else float(np.sqrt(np.mean(u**2)))
    return Trend(
        at=at,
        level_at=float(fit.coefficients[0]),
        slope=float(fit.coefficients[1]),
        u_slope=float(fit.u[1]),
        slope_interval=(float(low), float(high)),
        dof=float(fit.dof[1]),
        p_value=float(fit.p_value[1]),
        covariance=fit.covariance,
        within=fit.within,
        between=fit.between,
        run_sd=float(np.hypot(fit.within * run_u, fit.between)),
        n=len(y),
        days=len(means),
        confidence=p,
        robust_slope=slope,
        robust_interval=interval if ranked else None,
        monotone=monotone,
    )


def trend(
    values: npt.ArrayLike,
    times: npt.ArrayLike,
    *,
    u: npt.ArrayLike | None = None,
    days: npt.ArrayLike | None = None,
    level: float = 0.95,
    robust: bool = True,
) -> Trend:
    """Drift of ``values`` (n,), any unit, over ``times`` (n,), any unit.

    ``u`` (n,) standard uncertainties in the unit of the values (what is common to all runs, such as the
    scale bar, moves no slope and is better left out); their common scale is estimated. ``days`` (n,) labels
    whose runs share a day component, and which count at the mean time of the day; None: every run is its own day.
    At least three days. Without ``robust`` what rests on the slopes of all pairs of days is left out (NaN, None):
    a forecast has no use for it. Raises ``DataError`` for fewer, for times that are all alike, non-finite values, or
    ``u`` not above zero.
    Neglected: serial correlation between days, except in ``monotone``.
    Measured false alarms at 5 %: 1 to 6 % for 3 to 40 days (1 to 2 % with few days and no day component).
    """
    y = as_vector(values, "values", least=3)
    t = as_vector(times, "times", length=len(y))
    run_u = None if u is None else as_positive(u, "u", length=len(y))
    as_probability(level, "level")
    index = np.arange(len(y)) if days is None else label_groups(days, len(y))[1]
    count = int(index.max()) + 1
    if count < 3:
        raise DataError(
            f"a trend over {count} day(s) cannot be told from their scatter; at least 3 are needed."
        )
    if np.ptp(t) == 0.0:
        raise DataError(f"all times are {t[0]}; a trend needs times that differ.")
    # All runs of a day count at its mean time: what happens within a day (a machine that warms up every morning) is
    # scatter of the runs and no drift of years, which a slope within the day would pass itself off as.
    weight = np.ones_like(t) if run_u is None else 1.0 / run_u**2
    on_day = (np.bincount(index, weight * t) / np.bincount(index, weight))[index]
    if np.ptp(on_day) == 0.0:
        raise DataError("all days have the same mean time; a trend needs days that differ.")
    at = float(on_day.mean())
    design = np.column_stack([np.ones_like(t), on_day - at])
    fit = fit_with_days(y, design, run_u, index)
    means, moments = day_averages(y, t, run_u, index)
    return _result(fit, at, y, run_u, (means, moments), level, robust)
