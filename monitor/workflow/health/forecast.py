"""The drift of a parameter as a report states it: a year, and when it reaches its limit."""

from __future__ import annotations

from datetime import date

import numpy as np

from monitor.reporting.health.records import Drift
from monitor.statistics import predict
from monitor.units import DAYS_PER_YEAR
from monitor.workflow.history.calendar import local_time
from monitor.workflow.history.drift import PieceDrift
from monitor.workflow.history.forecast import DriftForecast, horizon_of
from monitor.workflow.history.season import Season


def stated_drift(drift: PieceDrift, ahead: DriftForecast | None) -> Drift | None:
    """The drift a year as the report states it; None where the history is too short for that."""
    if ahead is None or drift.stated is None:
        return None

    def day(t: float) -> date | None:
        moment = local_time(t, ahead.offset) if t < horizon_of(ahead.origin) else None
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
        season_not_told=True if drift.season is Season.NOT_TOLD else None,
    )
