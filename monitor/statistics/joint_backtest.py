"""How good were forecasts of the longest error vector? Days of the past foretold by what was known before them.

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
from monitor.statistics.checks import as_probability
from monitor.statistics.forecast import predict
from monitor.statistics.joint_forecast import draw_lines, residual_correlation
from monitor.statistics.longest_vector import longest
from monitor.statistics.trend import Trend

#: Days foretold at most, evenly spread over those that can be: each costs a fit of every parameter.
FORETOLD = 8
#: Days of every parameter before the first forecast.
FEWEST_DAYS = 5
#: Simulated futures of each forecast: the ends of the interval are good to some 4 % of its half width.
DRAWS = 2000

#: Fits the line of a column to runs ``keep`` (n,); raises DataError where they do not suffice.
Fit = Callable[[int, npt.NDArray[np.bool_]], Trend]


@dataclass(frozen=True)
class LengthBacktest:
    """Forecasts of held-out days: ``covered`` of ``made`` longest vectors lay in their interval (``level``).

    ``bias`` and ``rms`` of measured less median, in the unit of the vectors; ``at`` (made,) the foretold runs' times.
    """

    made: int
    covered: int
    level: float
    bias: float
    rms: float
    at: Array

    @property
    def coverage(self) -> float:
        """Share of held-out days inside."""
        return self.covered / self.made


def backtest_longest(
    values: Array,
    times: Array,
    days: npt.NDArray[np.int64],
    fit: Fit,
    sensitivity: Array,
    offset: Array,
    *,
    rng: np.random.Generator,
    level: float = 0.95,
    foretold: int = FORETOLD,
    draws: int = DRAWS,
) -> LengthBacktest:
    """Foretell the first run of up to ``foretold`` days by the days before each.

    ``values`` (n, p) in the order of ``times`` (n,), NaN where a parameter has none or its last change lies ahead;
    ``days`` (n,) labels; ``sensitivity`` (k, 3, p) and ``offset`` (k, 3) as in ``forecast_longest``. Raises DataError
    where no day has five days of every parameter before it. The linearisation at today's values serves the past too.
    """
    tail = (1.0 - as_probability(level, "level")) / 2.0
    whole = np.isfinite(values).all(axis=1)
    labels, first = np.unique(days[whole], return_index=True)
    rows = np.sort(np.flatnonzero(whole)[first])
    possible = rows[_known_days(values, days, times, times[rows]) >= FEWEST_DAYS].tolist()
    if not possible:
        raise DataError(
            f"{len(labels)} days of all parameters since the last change are too few to foretell one of them by the "
            f"days before it; at least {FEWEST_DAYS + 1} are needed."
        )
    spread = np.unique(np.linspace(0, len(possible) - 1, min(foretold, len(possible))).round().astype(int))
    inside, misses = 0, []
    for row in (possible[i] for i in spread):
        before = (times < times[row]) & (days != days[row])
        lines = [fit(column, before & np.isfinite(values[:, column])) for column in range(values.shape[1])]
        left = np.column_stack(
            [values[before, column] - predict(line, times[before])[0] for column, line in enumerate(lines)]
        )
        correlation, _, _ = residual_correlation(left, days[before])
        level_dev, slope_dev, run_dev = draw_lines(lines, correlation, rng, draws)
        centre = np.array([line.at for line in lines])
        best = np.array([float(predict(line, times[row])[0]) for line in lines])
        future = best + level_dev + slope_dev * (times[row] - centre) + run_dev
        lengths = longest(future, sensitivity, offset)
        measured = float(longest(values[[row]], sensitivity, offset)[0])
        low, middle, high = np.quantile(lengths, [tail, 0.5, 1.0 - tail])
        inside += int(low <= measured <= high)
        misses.append(measured - middle)
    found = np.array(misses)
    return LengthBacktest(
        len(found),
        inside,
        level,
        float(found.mean()),
        float(np.sqrt((found**2).mean())),
        times[[possible[i] for i in spread]],
    )


def _known_days(values: Array, days: npt.NDArray[np.int64], times: Array, at: Array) -> npt.NDArray[np.intp]:
    """Fewest days (k,) of any parameter that had begun before each of the times ``at`` (k,)."""
    fewest = np.full(len(at), len(days))
    for column in values.T:
        own = np.isfinite(column)
        # Times do not fall: the first run of a day is where it is met first.
        begins = times[own][np.unique(days[own], return_index=True)[1]]
        fewest = np.minimum(fewest, np.searchsorted(np.sort(begins), at, side="left"))
    return fewest
