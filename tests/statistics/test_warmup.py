"""Warm-up: coverage of the time constant and of the stable time, false alarms, hot-cold."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
import scipy

from monitor.exceptions import DataError
from monitor.statistics import warm_up

HOT_COLD = Path(__file__).resolve().parents[1] / "references" / "campaign-parameters" / "hot-cold.csv"


@pytest.mark.parametrize("tau", [3.0, 6.0])
def test_intervals_of_tau_and_of_the_stable_time_cover(tau, rate_agrees):
    rng = np.random.default_rng(int(tau))
    t = np.linspace(0.0, 24.0, 44)
    taus = stables = 0
    for _ in range(300):
        fit = warm_up(5.0 * np.exp(-t / tau) + rng.normal(size=44), t, rng=rng, tolerance=0.5, trials=99)
        taus += fit.tau_interval[0] <= tau <= fit.tau_interval[1]
        stables += fit.stable_interval[0] <= tau * np.log(10.0) <= fit.stable_interval[1]
    assert rate_agrees(taus, 300, 0.95), taus / 300
    assert rate_agrees(stables, 300, 0.95), stables / 300


def test_false_alarm_rate_with_unequal_uncertainties(rate_agrees):
    rng = np.random.default_rng(4)
    t, u = np.linspace(0.0, 10.0, 20), rng.uniform(0.5, 2.0, 20)
    alarms = sum(
        warm_up(u * rng.normal(size=20), t, u=u, rng=rng, trials=199).p_value <= 0.05 for _ in range(500)
    )
    assert rate_agrees(alarms, 500, 0.05)


def test_hot_cold_is_stable_after_about_six_hours():
    with HOT_COLD.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    hours = np.array([float(row["hours"]) for row in rows])
    for name in ("EXX", "EYY", "EZZ"):
        fit = warm_up([float(row[name]) for row in rows], hours, rng=np.random.default_rng(5))
        assert fit.p_value < 0.001
        assert 1.0 < fit.tau_interval[0] < fit.tau < fit.tau_interval[1] < 4.0
        assert 2.0 < fit.stable_interval[0] < fit.stable_after < fit.stable_interval[1] < 8.0


def test_exact_exponential_is_recovered():
    t = np.linspace(0.5, 12.0, 30)
    noise = 1e-4 * np.random.default_rng(6).normal(size=30)
    fit = warm_up(
        2.0 - 8.0 * np.exp(-(t - 0.5) / 2.5) + noise, t, rng=np.random.default_rng(7), tolerance=0.8
    )
    assert fit.tau == pytest.approx(2.5, rel=0.01)
    assert fit.amplitude == pytest.approx(-8.0, rel=0.01)
    assert fit.final == pytest.approx(2.0, abs=0.02)
    assert fit.stable_after == pytest.approx(0.5 + 2.5 * np.log(10.0), rel=0.01)


def test_days_of_one_warm_up_are_fitted_as_curve_fit_does():
    rng = np.random.default_rng(8)
    day, hour = np.divmod(np.arange(24), 8)
    y = np.array([3.0, -5.0, 40.0])[day] + 6.0 * np.exp(-hour / 2.0) + 0.3 * rng.normal(size=24)
    fit = warm_up(y, hour, rng=rng, beside=(day[:, np.newaxis] == [1, 2]).astype(float))

    def curve(_, a, b, c, amplitude, tau):
        return np.array([a, b, c])[day] + amplitude * np.exp(-hour / tau)

    theirs, covariance = scipy.optimize.curve_fit(curve, hour, y, p0=[0.0, 0.0, 40.0, 5.0, 3.0])
    assert fit.tau == pytest.approx(theirs[4], rel=0.01)
    assert abs(fit.amplitude - theirs[3]) < 0.1 * np.sqrt(covariance[3, 3])
    assert fit.final == pytest.approx(theirs[:3].mean(), abs=0.02)
    assert fit.residual_sd == pytest.approx(
        np.sqrt(np.mean((y - curve(0, *theirs)) ** 2) * 24 / 19), rel=1e-3
    )
    assert fit.settles
    assert fit.share_seen == pytest.approx(1.0 - np.exp(-7.0 / theirs[4]), rel=0.01)


def test_refusals_say_what_is_needed():
    rng = np.random.default_rng(0)
    with pytest.raises(DataError, match="times has 3 different values; an exponential needs at least 4"):
        warm_up(np.arange(6.0), [0, 0, 1, 1, 2, 2], rng=rng)
    with pytest.raises(DataError, match="beside has 5 rows; 6 are needed"):
        warm_up(np.arange(6.0), np.arange(6.0), rng=rng, beside=np.ones(5))
    with pytest.raises(DataError, match="6 runs are too few for an exponential beside 3 columns"):
        warm_up(np.arange(6.0), np.arange(6.0), rng=rng, beside=np.eye(6)[:, 1:4])
    with pytest.raises(DataError, match="what is fitted beside the exponential explains it"):
        warm_up(np.arange(7.0), [0, 0, 1, 1, 2, 2, 3], rng=rng, beside=np.eye(4)[[0, 0, 1, 1, 2, 2, 3]])
    with pytest.raises(DataError, match="tolerance is 0; it must be above zero"):
        warm_up(np.arange(6.0), np.arange(6.0), rng=rng, tolerance=0)
    with pytest.raises(DataError, match="at least 6 are needed"):
        warm_up(np.arange(5.0), np.arange(5.0), rng=rng)
