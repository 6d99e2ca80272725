"""When one parameter leaves its tolerance, and how good such forecasts were. Parts of `monitor trend`."""

from __future__ import annotations

from dataclasses import replace

from monitor.exceptions import DataError
from monitor.statistics import Trend, backtest, forecast
from monitor.workflow.history.calendar import DAYS_PER_YEAR, date
from monitor.workflow.history.drift import SHORTEST_DAYS, PieceDrift
from monitor.workflow.history.series import Series
from monitor.workflow.trend.answer import Between, ForecastTest, LimitForecast

#: Days from which on forecasts are looked at: five to fit a line, and one to foretell.
BACKTEST_DAYS = 6
#: Days foretold at most, evenly spread: of five years of weeks all of them would be most of the time of a page.
FORETOLD = 60
#: A forecast beyond this many years is no forecast; the date is then left out.
HORIZON_YEARS = 20.0


def limit_forecast(
    series: Series, line: Trend | None, limit: float | None, check: float, reliability: float
) -> LimitForecast:
    """When the drift reaches the limit, and how likely the parameter is in tolerance at the next ``check``."""
    none = LimitForecast(limit, None, None, None, date(check, series.offset), None, None, None)
    if limit is None:
        return replace(none, why_no_forecast="no forecast: the machine file states no tolerance for it")
    if line is None:
        return replace(none, why_no_forecast="no forecast: there is no drift to extrapolate")
    origin = float(series.t[-1])
    horizon = origin + HORIZON_YEARS * DAYS_PER_YEAR
    ahead = forecast(
        line, (-limit, limit), origin, [max(check, origin)], reliability=reliability, horizon=horizon
    )
    crossing, offset = ahead.crossing, series.offset
    low, high = (date(t, offset) if t < horizon else None for t in crossing.interval)
    return replace(
        none,
        crosses_limit_at=None if crossing.at is None else date(crossing.at, offset),
        crosses_limit_interval=interval_or_none(low, high),
        in_tolerance_at_next_check=float(ahead.probability[0]),
        recommended_interval_days=float(min(ahead.recommended_interval, horizon - origin)),
        recommended_by=f"{ahead.method}: {reliability:g}",
    )


def interval_or_none(low: str | None, high: str | None) -> Between | None:
    """The ends of a crossing. An open end says that the drift may never get there (within the horizon)."""
    return None if low is None and high is None else (low, high)


def backtested(drift: PieceDrift) -> tuple[ForecastTest | None, str | None]:
    """How good forecasts of the present piece were: every day foretold by the days before it."""
    piece = drift.piece
    days = piece.day_count
    if drift.span < SHORTEST_DAYS:
        return None, "no backtest: there is no drift whose forecasts could be looked at"
    if days < BACKTEST_DAYS:
        return None, (
            f"no backtest: {days} days since the last change or event are too few to hold any out; "
            f"{BACKTEST_DAYS} are needed"
        )
    try:
        test = backtest(
            piece.values,
            piece.t,
            u=piece.weights(),
            days=piece.days,
            cycle=DAYS_PER_YEAR,
            most=FORETOLD,
            first=BACKTEST_DAYS - 1,
        )
    except DataError as error:
        return None, f"no backtest: {error}"
    return ForecastTest(
        made=test.forecasts, inside=test.covered, share_inside=test.coverage, level=test.level,
        bias=test.bias, rms=test.rms, unit=piece.unit,
        method="days foretold by the days before them since the last change, 60 at most; the first run of each counts",
    ), None  # fmt: skip
