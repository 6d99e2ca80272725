"""When one parameter leaves its tolerance, and how good such forecasts were. Parts of `monitor trend`."""

from __future__ import annotations

import numpy as np

from monitor.exceptions import DataError
from monitor.statistics import Forecast, Trend, backtest, forecast
from monitor.workflow.trend.parameter import DAYS_PER_YEAR, SHORTEST_DAYS, Document, Series, date

#: Days from which on forecasts are looked at: five to fit a line, and one to foretell.
BACKTEST_DAYS = 6
#: A forecast beyond this many years is no forecast; the date is then left out.
HORIZON_YEARS = 20.0


def prediction(
    series: Series, line: Trend | None, limit: float | None, check: float, reliability: float
) -> tuple[Document, Forecast | None]:
    """When the drift reaches the limit, and how likely the parameter is in tolerance at the next ``check``."""
    document: Document = {
        "limit": limit, "crosses_limit_at": None, "crosses_limit_interval": None, "in_tolerance_at_next_check": None,
        "next_check": date(check, series.offset), "recommended_interval_days": None, "recommended_by": None,
        "why_no_forecast": None,
    }  # fmt: skip
    if limit is None:
        return {
            **document,
            "why_no_forecast": "no forecast: the machine file states no tolerance for it",
        }, None
    if line is None:
        return {**document, "why_no_forecast": "no forecast: there is no drift to extrapolate"}, None
    now = float(series.t[-1])
    horizon = now + HORIZON_YEARS * DAYS_PER_YEAR
    found = forecast(line, (-limit, limit), now, [max(check, now)], reliability=reliability, horizon=horizon)
    crossing, offset = found.crossing, series.offset
    low, high = (date(x, offset) if x < horizon else None for x in crossing.interval)
    document |= {
        "crosses_limit_at": None if crossing.at is None else date(crossing.at, offset),
        # An open end says that the drift may never get there (within the horizon).
        "crosses_limit_interval": None if low is None and high is None else [low, high],
        "in_tolerance_at_next_check": float(found.probability[0]),
        "recommended_interval_days": float(min(found.recommended_interval, horizon - now)),
        "recommended_by": f"{found.method}: {reliability:g}",
    }
    return document, found


def backtested(series: Series, since: float) -> tuple[Document | None, str | None]:
    """How good forecasts of the piece since ``since`` were: every day foretold by the days before it."""
    piece = series.part(series.t >= since)
    days = piece.day_count
    if not len(piece.t) or np.ptp(piece.t) < SHORTEST_DAYS:
        return None, "no backtest: there is no drift whose forecasts could be looked at"
    if days < BACKTEST_DAYS:
        return None, (
            f"no backtest: {days} days since the last change or event are too few to hold any out; "
            f"{BACKTEST_DAYS} are needed"
        )
    try:
        found = backtest(piece.values, piece.t, u=piece.weights(), days=piece.days, first=BACKTEST_DAYS - 1)
    except DataError as error:
        return None, f"no backtest: {error}"
    return {
        "made": found.forecasts, "inside": found.covered, "share_inside": found.coverage, "level": found.level,
        "bias": found.bias, "rms": found.rms, "unit": series.unit,
        "method": "every day foretold by the days before it since the last change; its first run counts",
    }, None  # fmt: skip
