"""Forecasts: coverage of the crossing date and of predictions, probability in tolerance, backtest."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from monitor.exceptions import DataError
from monitor.statistics import backtest, forecast, predict
from monitor.statistics.trend import trend


def history(rng, days=12, slope=0.05):
    day = np.repeat(np.arange(days), 4)
    t = 7.0 * day + np.tile(0.05 * np.arange(4), days)
    return slope * t + rng.normal(size=len(t)) + 0.7 * rng.normal(size=days)[day], t, day


def test_interval_of_the_crossing_date_covers():
    rng = np.random.default_rng(1)
    hits = 0
    for _ in range(250):
        y, t, day = history(rng)
        low, high = forecast(trend(y, t, days=day), (-10.0, 10.0), 84.0, []).crossing.interval
        hits += low <= 200.0 <= high
    # Twelve days do not say that they are independent: what they may resemble each other is allowed for.
    assert hits / 250 > 0.93


def test_predicted_probabilities_are_calibrated():
    rng = np.random.default_rng(2)
    below = {0.1: 0, 0.5: 0, 0.9: 0}
    trials = 400
    for _ in range(trials):
        y, t, day = history(rng)
        line = trend(y, t, days=day)
        seen = 0.05 * 120.0 + rng.normal() + 0.7 * rng.normal()
        # The stated probability of a run at most as high as the one that came is uniform.
        stated = forecast(line, (-np.inf, seen), 84.0, [120.0]).probability[0]
        for p in below:
            below[p] += stated < p
    for p, count in below.items():
        # Student's t with the degrees of freedom of the slope is a little wide: allow two per cent.
        assert abs(count / trials - p) < 0.02 + 3.3 * np.sqrt(p * (1 - p) / trials), (p, count)


@pytest.mark.parametrize("with_common", [True, False])
def test_what_all_runs_are_off_by_is_in_the_crossing_date(with_common):
    """A laser that is off by a number of standard deviation 6 moves all runs: the date at which the machine itself
    reaches its limit lies in the interval with it (148 of 150), without in 118 only."""
    rng = np.random.default_rng(4)
    hits, trials, common = 0, 150, 6.0
    for _ in range(trials):
        y, t, day = history(rng)
        known = np.full((len(y), 1), common) if with_common else None
        line = trend(y + rng.normal(0.0, common), t, days=day, common=known, robust=False)
        low, high = forecast(line, (-60.0, 10.0), 84.0, []).crossing.interval
        hits += low <= 200.0 <= high
    assert hits / trials > 0.93 if with_common else hits / trials < 0.86, hits


def test_recommended_interval_is_where_the_probability_falls_below_the_reliability():
    y, t, day = history(np.random.default_rng(3))
    line = trend(y, t, days=day)
    result = forecast(line, (-10.0, 10.0), 84.0, [], reliability=0.9)
    due = 84.0 + result.recommended_interval
    before, after = forecast(line, (-10.0, 10.0), 84.0, [due, due * 1.05]).probability
    assert before >= 0.9 > after
    assert result.crossing.at is not None
    assert due < result.crossing.at
    assert result.crossing.interval[0] < result.crossing.at < result.crossing.interval[1]
    value, _, _ = predict(line, [result.crossing.at])
    assert value[0] == pytest.approx(10.0, abs=1e-6)


def test_a_machine_that_does_not_drift_is_not_said_to_cross():
    t = np.arange(40.0)
    result = forecast(trend(np.random.default_rng(4).normal(size=40), t), (-30.0, 30.0), 40.0, [50.0])
    assert result.crossing.interval[1] == np.inf
    assert result.recommended_interval == np.inf
    assert result.probability[0] > 0.999999


def test_one_sided_limit_for_a_volumetric_error():
    t = np.arange(20.0)
    y = 5.0 + 0.2 * t + 0.01 * np.random.default_rng(5).normal(size=20)
    result = forecast(trend(y, t), (-np.inf, 11.0), 20.0, [])
    assert result.crossing.limit == 11.0
    assert result.crossing.at == pytest.approx(30.0, abs=0.3)


def test_backtest_covers_and_sees_a_change_that_no_drift_foretold():
    rng = np.random.default_rng(6)
    made = covered = 0
    for _ in range(60):
        y, t, day = history(rng, days=14)
        result = backtest(y, t, days=day, first=6)
        made, covered = made + result.forecasts, covered + result.covered
    assert made == 60 * 8
    assert 0.93 < covered / made <= 1.0  # conservative with few days, see predict
    y, t, day = history(rng, days=14)
    y[day >= 8] += 30.0
    assert backtest(y, t, days=day).coverage < 0.95


@pytest.mark.parametrize("repeats", ["one run a day", "days of their own size"])
@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("between", [0.0, 0.5, 300.0])
def test_backtest_of_all_days_at_once_is_that_of_each_day_by_itself(repeats, weighted, between):
    rng = np.random.default_rng([3, weighted, int(between)])
    sizes = np.ones(20, dtype=int) if repeats == "one run a day" else rng.integers(1, 5, 20)
    day = np.repeat(rng.permutation(20), sizes)
    t = 2e4 + 7.0 * day + 0.1 * rng.random(len(day))
    u = rng.uniform(0.3, 2.0, len(day)) if weighted else None
    y = 50.0 + between * rng.normal(size=20)[day] + rng.normal(size=len(day)) * (1.0 if u is None else u)
    z, errors, inside = [], [], 0
    for target in range(6, 20):
        past = day <= target - 2
        line = trend(y[past], t[past], u=None if u is None else u[past], days=day[past])
        run = int(np.flatnonzero(day == target)[0])
        value, _, spread = predict(line, t[run])
        errors.append(y[run] - value)
        z.append(errors[-1] / spread)
        inside += abs(z[-1]) <= stats.t.isf(0.025, line.dof)
    found = backtest(y, t, u=u, days=day, first=5, ahead=2)
    assert (found.forecasts, found.covered) == (14, inside)
    np.testing.assert_allclose(found.z, z, rtol=1e-8, atol=1e-9)
    assert found.bias == pytest.approx(np.mean(errors), rel=1e-8)
    assert found.rms == pytest.approx(np.sqrt(np.mean(np.square(errors))), rel=1e-8)


def test_refusals_say_what_is_needed():
    line = trend(np.sin(np.arange(10.0)), np.arange(10.0))
    with pytest.raises(DataError, match=r"limits is \(5\.0, -5\.0\); the lower must be below"):
        forecast(line, (5.0, -5.0), 10.0, [])
    with pytest.raises(DataError, match=r"a planned check cannot lie before now, 10\.0"):
        forecast(line, (-5.0, 5.0), 10.0, [3.0])
    with pytest.raises(DataError, match="must not lie before the mean time"):
        forecast(line, (-5.0, 5.0), 1.0, [])
    with pytest.raises(DataError, match=r"the history has 4 days; first \+ ahead = 6 are needed"):
        backtest(np.arange(4.0), np.arange(4.0))
    with pytest.raises(
        DataError, match="the first days have the same mean time; a trend needs days that differ"
    ):
        backtest(np.arange(8.0), np.repeat([1.0, 2.0], [6, 2]))
