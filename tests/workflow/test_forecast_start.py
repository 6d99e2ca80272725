"""From where a limit is foretold: the line at the last run, and the latest mean beside it, by arithmetic of its own."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta

import numpy as np
import pytest

from monitor.cli.forecast_output import forecast_start
from monitor.workflow.history.drift import PieceDrift
from monitor.workflow.history.series import Series
from monitor.workflow.trend.answer import ParameterTrend
from monitor.workflow.trend.forecast import limit_forecast
from monitor.workflow.trend.parameter import drift_statement, latest_mean

#: Campaigns of five days; in the last the machine moves by half a micrometre a run, as the fresh user's did.
DAYS = np.concatenate([35.0 * number + np.arange(5.0) for number in range(6)])
FIRST = 20_000.3


def history(latest: float = 0.0, campaigns: int = 6) -> Series:
    """Runs an hour apart that end ``latest`` above what they rise to."""
    rng = np.random.default_rng(16)
    day = np.repeat(DAYS[-5 * campaigns :], 4)
    number = np.tile(np.arange(4), 5 * campaigns)
    warmth = 20.0 + 0.3 * (day % 35.0) + 0.2 * number
    values = 15.0 + 0.5 * np.maximum(np.arange(len(day)) - len(day) + 20, 0) + 0.3 * rng.normal(size=len(day))
    values[-4:] += latest
    days, count = np.repeat(np.arange(len(day) // 4), 4), len(day)
    return Series(
        "EZ0A", "µm", values, np.full(count, 0.15), FIRST + day + number / 24.0, days, 8.0 + number,
        np.zeros(count, dtype=bool), timedelta(hours=2), warmth, "ambient_degC",
    )  # fmt: skip


def trend_of(series: Series, limit: float) -> ParameterTrend:
    drift = PieceDrift(series, -np.inf)
    return ParameterTrend(
        "µm", drift_statement(drift), latest_mean(drift), (), (), None, (), None, (), None, None, None,
        limit_forecast(drift, limit, float(series.t[-1]) + 30.0, 0.95), None, None, None, None,
    )  # fmt: skip


def test_the_row_of_latest_mean_slope_and_day_is_explained_by_the_level_it_starts_from():
    series = history()
    parameter = trend_of(series, 26.0)
    forecast, start = parameter.forecast, parameter.forecast.start
    days = (datetime.fromisoformat(forecast.crosses_limit_at).timestamp() / 86400.0) - series.t[-1]
    # What is printed holds together: level at the last run and slope reach the limit on the day that is printed.
    assert start.value + parameter.drift.slope_per_year / 365.25 * days == pytest.approx(26.0, abs=0.01)
    alone = (datetime.fromisoformat(start.from_latest_at).timestamp() / 86400.0) - series.t[-1]
    assert parameter.mean.latest + parameter.drift.slope_per_year / 365.25 * alone == pytest.approx(
        26.0, abs=0.01
    )
    # The temperature's share, by the normal equations of the means of days.
    index = series.days
    y, t, warmth = (
        np.bincount(index, column) / 4.0 for column in (series.values, series.t, series.temperature)
    )
    level = np.column_stack([np.ones(30), warmth - warmth.mean(), t - t.mean()])
    coefficient = np.linalg.lstsq(level, y, rcond=None)[0]
    assert start.by_temperature == pytest.approx(coefficient[1] * (warmth[-1] - warmth.mean()), rel=1e-6)
    assert start.value == pytest.approx(coefficient[0] + coefficient[2] * (series.t[-1] - t.mean()), abs=0.01)
    (sentence,) = forecast_start("EZ0A", parameter)
    assert f"is counted from {start.value:.3g} µm, where the line through all days stands" in sentence
    assert "at 20.9 °C, the mean of its runs" in sentence
    assert sentence.endswith(f"µm, comes to it on {start.from_latest_at[:10]}")


def test_nothing_is_said_where_both_come_to_the_limit_alike_or_the_latest_lies_beyond():
    parameter = trend_of(history(), 26.0)
    start = replace(parameter.forecast.start, from_latest_at=parameter.forecast.crosses_limit_at)
    assert not list(
        forecast_start("EZ0A", replace(parameter, forecast=replace(parameter.forecast, start=start)))
    )
    beyond = trend_of(history(latest=4.0), 26.0)
    assert beyond.mean.latest > 26.0
    assert beyond.forecast.start is None or beyond.forecast.start.from_latest_at is None
    assert not list(forecast_start("EZ0A", beyond))


def test_two_campaigns_have_no_temperature_beside_their_line():
    """Days at 0.8 in a shop that is warmer every day: 85 % of the intervals of the slope held it, now all do."""
    assert PieceDrift(history(), -np.inf).thermometer == "ambient_degC"
    assert PieceDrift(history(campaigns=2), -np.inf).thermometer is None
    rng = np.random.default_rng(2027)
    times = np.repeat(DAYS[:10], 3)
    root = np.linalg.cholesky(0.8 ** np.abs(np.subtract.outer(DAYS[:10], DAYS[:10])))
    missed = 0
    for _ in range(60):
        values = np.repeat(root @ rng.normal(size=10), 3) + 0.5 * rng.normal(size=30)
        warmth = 20.0 + 0.3 * (times % 35.0) + 0.05 * rng.normal(size=30)
        series = Series(
            "EZ0A", "µm", values, np.ones(30), times, np.repeat(np.arange(10), 3), 8.0 + 0.0 * times,
            np.zeros(30, dtype=bool), timedelta(0), warmth, "ambient_degC",
        )  # fmt: skip
        low, high = PieceDrift(series, -np.inf).line.slope_interval
        missed += not low <= 0.0 <= high
    # Of 85 % one in a thousand such sets would have so few.
    assert missed <= 1
