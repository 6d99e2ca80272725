"""Backtest of forecasts of the longest error vector: days of the past foretold by the days before them.

The parameters are extrapolated together as ``forecast_longest`` does; what is compared is the longest vector of a run
that was measured with the median and the interval of the longest vectors of such a run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.forecasts.forecast import predict
from monitor.statistics.forecasts.joint_forecast import JointLines, draw_lines, residual_correlation
from monitor.statistics.forecasts.longest_vector import ErrorVectors
from monitor.statistics.trend import Trend

#: Days foretold at most, evenly spread over those that can be: each costs a fit of every parameter.
FORETOLD = 8
#: Days of every parameter before the first forecast.
FEWEST_DAYS = 5
#: Simulated futures of each forecast: the ends of the interval are good to some 4 % of its half width.
DRAWS = 2000
#: Probability of the intervals.
LEVEL = 0.95

#: Fits the line of a column to runs ``keep`` (n,); raises DataError where they do not suffice.
Fit = Callable[[int, npt.NDArray[np.bool_]], Trend]


@dataclass(frozen=True)
class LengthBacktest:
    """Forecasts of held-out days: ``covered`` of ``forecasts`` longest vectors lay in their interval (``level``).

    ``bias`` and ``rms`` of measured less median, in the unit of the vectors; ``at`` (forecasts,) the runs' times.
    """

    forecasts: int
    covered: int
    level: float
    bias: float
    rms: float
    at: Array

    @property
    def coverage(self) -> float:
        """Share of held-out days inside."""
        return self.covered / self.forecasts


@dataclass(frozen=True)
class JointSeries:
    """``values`` (n, p) of p parameters in the order of ``times`` (n,), with labels of their ``days`` (n,).

    A value is NaN where a parameter has none, or where its last change lies ahead.
    """

    values: Array
    times: Array
    days: npt.NDArray[np.int64]


def backtest_longest(
    series: JointSeries,
    fit: Fit,
    vectors: ErrorVectors,
    *,
    rng: np.random.Generator,
    foretold: int = FORETOLD,
    draws: int = DRAWS,
) -> LengthBacktest:
    """Foretell the first run of up to ``foretold`` days by the days before each, with intervals of ``LEVEL``.

    Raises DataError where no day has five days of every parameter before it. The linearisation at today's values serves
    the past too.
    """
    rows = _foretold_rows(series, foretold)
    forecasts = [_forecast(series, row, fit, vectors, rng, draws) for row in rows]
    errors = np.array([measured - median for measured, (_, median, _) in forecasts])
    return LengthBacktest(
        len(errors),
        sum(low <= measured <= high for measured, (low, _, high) in forecasts),
        LEVEL,
        float(errors.mean()),
        float(np.sqrt((errors**2).mean())),
        series.times[rows],
    )


def _foretold_rows(series: JointSeries, foretold: int) -> list[int]:
    """Return the first runs of the days to be foretold, evenly spread over those that can be."""
    whole = np.isfinite(series.values).all(axis=1)
    labels, first = np.unique(series.days[whole], return_index=True)
    rows = np.sort(np.flatnonzero(whole)[first])
    possible = rows[_fewest_days(series, series.times[rows]) >= FEWEST_DAYS].tolist()
    if not possible:
        raise DataError(
            f"{len(labels)} days of all parameters since the last change are too few to foretell one of them by the "
            f"days before it; at least {FEWEST_DAYS + 1} are needed."
        )
    spread = np.unique(np.linspace(0, len(possible) - 1, min(foretold, len(possible))).round().astype(int))
    return [possible[index] for index in spread]


def _forecast(
    series: JointSeries, row: int, fit: Fit, vectors: ErrorVectors, rng: np.random.Generator, draws: int
) -> tuple[float, tuple[float, float, float]]:
    """Return the measured length of a run, and the low end, median and high end of its forecast."""
    values, times, days = series.values, series.times, series.days
    before = (times < times[row]) & (days != days[row])
    lines = [fit(column, before & np.isfinite(values[:, column])) for column in range(values.shape[1])]
    residuals = np.column_stack(
        [values[before, column] - predict(line, times[before])[0] for column, line in enumerate(lines)]
    )
    correlation, _, _ = residual_correlation(residuals, days[before])
    joint = JointLines(lines, correlation)
    futures = draw_lines(joint, rng, draws)
    future = (
        joint.predict(times[row]) + futures.level + futures.slope * (times[row] - joint.centre) + futures.run
    )
    lengths = vectors.longest(future)
    tail = (1.0 - LEVEL) / 2.0
    low, median, high = np.quantile(lengths, [tail, 0.5, 1.0 - tail])
    return float(vectors.longest(values[[row]])[0]), (float(low), float(median), float(high))


def _fewest_days(series: JointSeries, at: Array) -> npt.NDArray[np.intp]:
    """Return the fewest days (k,) of any parameter that had begun before each of the times ``at`` (k,)."""
    fewest = np.full(len(at), len(series.days))
    for column in series.values.T:
        is_measured = np.isfinite(column)
        # Times do not fall: the first run of a day is its first row.
        begins = series.times[is_measured][np.unique(series.days[is_measured], return_index=True)[1]]
        fewest = np.minimum(fewest, np.searchsorted(np.sort(begins), at, side="left"))
    return fewest
