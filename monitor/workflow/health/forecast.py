"""The drift of a parameter as a report uses it: when it reaches its limit, and how long a run stays in tolerance."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date

import numpy as np

from monitor.exceptions import DataError, InputError
from monitor.reporting.health.records import Drift
from monitor.statistics import Forecast, Trend, forecast, predict
from monitor.workflow.history.calendar import DAYS_PER_YEAR, local_time
from monitor.workflow.history.drift import PieceDrift


@dataclass(frozen=True)
class DriftForecast:
    """The line of a drift and what it foretells, no further than ``horizon``, the days that the history is long.

    ``good_for`` is how many days a run stays in tolerance with 95 %, None without a tolerance.
    """

    line: Trend
    horizon: float
    ahead: Forecast | None

    @property
    def good_for(self) -> float | None:
        """Days that the parameter stays in tolerance, at most the horizon; None without a tolerance."""
        return None if self.ahead is None else float(min(self.ahead.recommended_interval, self.horizon))


def drift_forecast(drift: PieceDrift, last_run: float, tolerance: float | None) -> DriftForecast | None:
    """The drift since the last change, and its forecast from ``last_run`` on (days since 1970).

    None with fewer than three days. Nothing is said of times further ahead than the history is long.
    """
    line, span = drift.line, drift.span
    if line is None:
        return None
    if tolerance is None:
        return DriftForecast(line, span, None)
    try:
        return DriftForecast(
            line, span, forecast(line, (-tolerance, tolerance), last_run, [], horizon=last_run + span)
        )
    except (DataError, InputError):
        return None


def stated_drift(drift: PieceDrift, ahead: DriftForecast | None) -> Drift | None:
    """The drift a year as the report states it; None where the history is too short for that."""
    if ahead is None or drift.stated is None:
        return None

    def day(t: float) -> date | None:
        moment = local_time(t, drift.piece.offset)
        return None if moment is None else moment.date()

    line = ahead.line
    low, high = line.slope_interval
    crossing = None if ahead.ahead is None else ahead.ahead.crossing
    begin, end = (np.inf, np.inf) if crossing is None else crossing.interval
    return Drift(
        line.slope * DAYS_PER_YEAR,
        line.u_slope * DAYS_PER_YEAR,
        (low * DAYS_PER_YEAR, high * DAYS_PER_YEAR),
        line.p_value,
        None if crossing is None or crossing.at is None else day(crossing.at),
        (day(begin), day(end)),
        at_last=float(predict(line, [drift.piece.t[-1]])[0][0]),
        since=local_time(float(drift.piece.t[0]), drift.piece.offset),
    )
