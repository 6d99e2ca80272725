"""When a parameter leaves its tolerance: the one forecast that the trend page and the health report state.

The drift since the last change is extrapolated from the last steady run of the parameter on. Its line gives the day on
which the limit is reached, at most ``HORIZON_YEARS`` ahead. The recommended interval is never longer than the history
of the drift: that it goes on for longer is an assumption that no run supports.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import timedelta

from monitor import statistics
from monitor.exceptions import DataError
from monitor.statistics import Trend
from monitor.units import DAYS_PER_YEAR
from monitor.workflow.history.calendar import date
from monitor.workflow.history.drift import PieceDrift

#: A limit that is reached later than this many years ahead has no date.
HORIZON_YEARS = 20.0
#: Wanted probability of a run in tolerance until the next check.
RELIABILITY = 0.95
#: The next check of a machine of one campaign, in days after its last run.
NEXT_CHECK_D = 30.0


@dataclass(frozen=True)
class DriftForecast:
    """A drift of ``span`` days against a limit of its absolute value, from ``origin`` on (days since 1970).

    ``ahead`` is None where nothing limits the parameter. Days are counted by a clock ``offset`` from UTC.
    """

    line: Trend
    origin: float
    span: float
    offset: timedelta
    ahead: statistics.Forecast | None

    @property
    def good_for(self) -> float | None:
        """Days from ``origin`` on that a run stays in tolerance, at most the span; None without a limit."""
        return None if self.ahead is None else recommended(self.ahead.recommended_interval, self.span)


def horizon_of(origin: float) -> float:
    """Return the time beyond which nothing is forecast (days since 1970)."""
    return origin + HORIZON_YEARS * DAYS_PER_YEAR


def recommended(interval: float, span: float) -> float:
    """Return the interval that may be recommended, in days: no drift is trusted for longer than it was watched."""
    return float(min(interval, span))


def crossing_dates(
    crossing: statistics.Crossing, horizon: float, offset: timedelta
) -> tuple[str | None, tuple[str | None, str | None] | None]:
    """Return the day of a crossing and the ends of its interval; None where open, that is beyond the horizon."""
    low, high = (date(t, offset) if t < horizon else None for t in crossing.interval)
    at = None if crossing.at is None else date(crossing.at, offset)
    return at, None if low is None and high is None else (low, high)


def probability_inside(line: Trend, limit: float, at: float) -> float:
    """Return the probability that a run at a time is within ± ``limit`` by a line."""
    ahead = statistics.forecast(line, (-limit, limit), at, [at], horizon=horizon_of(at))
    return float(ahead.probability[0])


def drift_forecast(
    drift: PieceDrift, limit: float | None, check: float | None = None, reliability: float = RELIABILITY
) -> DriftForecast | None:
    """Forecast the drift since the last change against ± ``limit``; ``check`` is when the machine is looked at next.

    None where no line goes through the piece (fewer than three days), or it foretells nothing.
    """
    line = drift.line
    if line is None:
        return None
    origin, offset = float(drift.whole.t[-1]), drift.whole.offset
    if limit is None:
        return DriftForecast(line, origin, drift.span, offset, None)
    checks = [] if check is None else [max(check, origin)]
    try:
        ahead = statistics.forecast(
            line,
            (-limit, limit),
            origin,
            checks,
            reliability=reliability,
            horizon=horizon_of(origin),
        )
    except DataError:
        return None
    return DriftForecast(line, origin, drift.span, offset, ahead)
