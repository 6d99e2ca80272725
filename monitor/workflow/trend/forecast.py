"""When one parameter leaves its tolerance, and how good such forecasts were. Parts of `monitor trend`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from monitor.exceptions import DataError
from monitor.reporting.lacks import Cause, Lack, Part, refused
from monitor.reporting.origins import OUT_OF_TOLERANCE, ForecastMethod
from monitor.statistics import Trend, backtest, predict
from monitor.units import DAYS_PER_YEAR
from monitor.workflow.history.calendar import date
from monitor.workflow.history.drift import SHORTEST_DAYS, PieceDrift
from monitor.workflow.history.forecast import crossing_dates, drift_forecast, probability_inside
from monitor.workflow.history.series import Series
from monitor.workflow.trend.answer import ForecastStart, ForecastTest, LimitForecast

#: Days from which on forecasts are looked at: five to fit a line, and one to foretell.
BACKTEST_DAYS = 6
#: Days foretold at most, evenly spread: of five years of weeks all of them would be most of the time of a page.
FORETOLD = 60


def limit_forecast(drift: PieceDrift, limit: float | None, check: float, reliability: float) -> LimitForecast:
    """When the drift reaches the limit, and how likely the parameter is in tolerance at the next ``check``.

    A history that is too short for a slope a year has no date; it may still say for how long a run is good.
    """
    none = LimitForecast(limit, None, None, None, date(check, drift.whole.offset), None, None, None)
    if limit is None:
        return replace(none, why_no_forecast=Lack(Part.FORECAST, Cause.NO_TOLERANCE))
    beyond = _beyond_since(drift.whole, limit)
    none = replace(none, beyond_since=beyond)
    latest = float(drift.whole.values[drift.of_latest_day].mean())
    if abs(latest) > limit:
        return _out_of_tolerance(none, drift, latest, check, reliability)
    of_drift = drift_forecast(drift, limit, check, reliability)
    if of_drift is None or of_drift.ahead is None:
        return replace(none, why_no_forecast=Lack(Part.FORECAST, Cause.NO_DRIFT))
    ahead = of_drift.ahead
    none = replace(
        none,
        recommended_interval_days=of_drift.good_for,
        recommended_by=f"{ahead.method}: {reliability:g}",
    )
    if drift.stated is None:
        return replace(none, why_no_forecast=Lack(Part.FORECAST, Cause.NO_DRIFT))
    at, interval = None, None
    if beyond is None:
        at, interval = crossing_dates(ahead.crossing, ahead.horizon, of_drift.offset)
    return replace(
        none,
        crosses_limit_at=at,
        crosses_limit_interval=interval,
        in_tolerance_at_next_check=float(ahead.probability[0]),
        start=None if at is None else _start(drift, of_drift.line, ahead.crossing.limit),
    )


def _out_of_tolerance(
    none: LimitForecast, drift: PieceDrift, latest: float, check: float, reliability: float
) -> LimitForecast:
    """The forecast of a parameter whose ``latest`` mean is beyond its limit: it is to be checked at once, whatever its
    line foretells, and a run at the next ``check`` is in tolerance at most as surely as from that level on."""
    assert none.limit is not None
    at_once = replace(none, recommended_interval_days=0.0, recommended_by=OUT_OF_TOLERANCE)
    of_drift = drift_forecast(drift, none.limit, check, reliability)
    if of_drift is None or of_drift.ahead is None or drift.stated is None:
        return replace(at_once, why_no_forecast=Lack(Part.FORECAST, Cause.NO_DRIFT))
    line, inside = of_drift.line, float(of_drift.ahead.probability[0])
    higher = latest - float(predict(line, of_drift.origin)[0])
    from_latest = probability_inside(
        replace(line, level_at=line.level_at + higher), none.limit, max(check, of_drift.origin)
    )
    at, interval = None, None
    if none.beyond_since is None:
        at, interval = crossing_dates(of_drift.ahead.crossing, of_drift.ahead.horizon, of_drift.offset)
    return replace(
        at_once,
        crosses_limit_at=at,
        crosses_limit_interval=interval,
        in_tolerance_at_next_check=min(inside, from_latest),
    )


def _start(drift: PieceDrift, line: Trend, limit: float) -> ForecastStart:
    """Where the line stands at the last run, and when the latest mean would reach the ``limit`` by its slope."""
    whole, piece = drift.whole, drift.piece
    origin = float(whole.t[-1])
    last = drift.of_latest_day
    to_go = limit - float(whole.values[last].mean())
    days = to_go / line.slope if to_go * line.slope > 0.0 and to_go * limit > 0.0 else np.inf
    start = ForecastStart(
        value=float(predict(line, origin)[0]), from_latest_at=date(origin + days, whole.offset)
    )
    if drift.thermometer is None or piece.temperature is None or whole.temperature is None:
        return start
    mean, latest = float(piece.temperature.mean()), float(whole.temperature[last].mean())
    return replace(
        start, temperature=mean, latest_temperature=latest, by_temperature=line.beside[0] * (latest - mean)
    )


def _beyond_since(steady: Series, limit: float) -> str | None:
    """Return when the last runs beyond ± ``limit`` without a break began; None where the last one is within."""
    within = np.flatnonzero(np.abs(steady.values) <= limit)
    first = int(within[-1]) + 1 if within.size else 0
    return date(float(steady.t[first]), steady.offset) if first < len(steady.t) else None


def backtested(drift: PieceDrift) -> tuple[ForecastTest | None, Lack | None]:
    """How good forecasts of the present piece were: every day foretold by the days before it."""
    piece = drift.piece
    days = piece.day_count
    if drift.span < SHORTEST_DAYS:
        return None, Lack(Part.BACKTEST, Cause.NO_DRIFT_TO_TEST)
    if days < BACKTEST_DAYS:
        return None, Lack(Part.BACKTEST, Cause.FEW_DAYS, count=days, needed=(BACKTEST_DAYS,))
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
        return None, refused(Part.BACKTEST, error)
    return ForecastTest(
        forecasts=test.forecasts, inside=test.covered, share_inside=test.coverage, level=test.level,
        bias=test.bias, rms=test.rms, unit=piece.unit,
        method=ForecastMethod.DAYS_BY_DAYS_BEFORE,
    ), None  # fmt: skip
