"""Backtest of the longest vector: coverage over many histories, a wrong model is seen, days are counted."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.statistics import ErrorVectors, JointSeries, backtest_longest
from monitor.statistics.trend import trend

DAYS, RUNS = 24, 2
DAY = np.repeat(np.arange(DAYS), RUNS)
TIMES = DAY * 7.0 + np.tile([0.0, 0.1], DAYS)


def history(rng, bend=0.0):
    """Three correlated parameters that drift, with a component of the day; (n, 3)."""
    root = np.linalg.cholesky(np.array([[1.0, 0.7, 0.0], [0.7, 1.0, 0.0], [0.0, 0.0, 1.0]]))
    line = np.array([8.0, 5.0, 2.0]) + np.array([0.03, 0.02, 0.0]) * TIMES[:, np.newaxis]
    line[:, 0] += bend * np.maximum(TIMES - 80.0, 0.0)
    return line + (rng.normal(size=(DAYS, 3)) @ root.T)[DAY] + 0.5 * rng.normal(size=(len(DAY), 3))


def backtested(values, sensitivity, rng, **options):
    def fit(column, keep):
        return trend(values[keep, column], TIMES[keep], days=DAY[keep])

    return backtest_longest(
        JointSeries(values, TIMES, DAY),
        fit,
        ErrorVectors(sensitivity, np.zeros((len(sensitivity), 3))),
        rng=rng,
        draws=500,
        **options,
    )


def test_share_of_held_out_days_in_their_interval_over_many_histories(rate_agrees):
    rng = np.random.default_rng(1)
    made = inside = 0
    misses = []
    for _ in range(40):
        found = backtested(history(rng), rng.normal(size=(5, 3, 3)), rng, foretold=4)
        made, inside = made + found.forecasts, inside + found.covered
        misses.append(found.bias)
    assert made == 160
    assert rate_agrees(inside, made, 0.95), inside / made
    assert abs(np.mean(misses)) < 4.0 * np.std(misses) / np.sqrt(40)


def test_a_drift_that_bends_is_seen_as_forecasts_that_miss():
    rng = np.random.default_rng(2)
    along = np.array([[[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]])
    straight, bent = (backtested(history(rng, bend), along, rng, foretold=12) for bend in (0.0, 0.3))
    # What bends looks like days that resemble each other: the intervals hold it, the bias tells.
    assert straight.coverage > 0.8
    assert bent.bias > 2.0 > 3.0 * abs(straight.bias)


def test_one_parameter_is_foretold_as_by_its_own_line():
    rng = np.random.default_rng(3)
    # Far from zero, where a length is the value itself.
    values = history(rng)[:, :1] + 1000.0
    found = backtested(values, np.array([[[1.0], [0.0], [0.0]]]), rng, foretold=100)
    # The days before the sixth are too few; every later one is foretold.
    assert found.forecasts == DAYS - 5
    assert found.at.tolist() == TIMES[::RUNS][5:].tolist()
    misses = []
    for at in found.at:
        keep = at > TIMES
        line = trend(values[keep, 0], TIMES[keep], days=DAY[keep])
        misses.append(
            values[np.flatnonzero(at == TIMES)[0], 0] - (line.level_at + line.slope * (at - line.at))
        )
    assert found.bias == pytest.approx(np.mean(misses), abs=0.3)
    assert found.rms == pytest.approx(np.sqrt(np.mean(np.square(misses))), rel=0.15)


def test_a_change_ahead_and_few_days_are_refused():
    rng = np.random.default_rng(4)
    values = history(rng)
    values[: 2 * (DAYS - 5), 1] = np.nan
    with pytest.raises(
        DataError, match="5 days of all parameters since the last change are too few to foretell"
    ):
        backtested(values, rng.normal(size=(2, 3, 3)), rng)
