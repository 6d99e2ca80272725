"""Conditions, cycles, warm-up and run lengths against other people's code and published tables on the same numbers."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
import statsmodels.api as sm
from scipy import optimize, signal

from monitor.statistics import DependenceUnits, dependence, mewma_limit, warm_up
from monitor.statistics.charts.run_length import cusum_run_length, ewma_run_length
from monitor.units import DEGREE_CELSIUS, METRE, MICROMETRE

HOT_COLD = Path(__file__).resolve().parents[1] / "references" / "campaign-parameters" / "hot-cold.csv"
#: Shifts of the published tables, in standard deviations.
SHIFTS = np.array([0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0])


def history(seed: int, days: int, runs: int, between: float):
    """Values with a drift and two channels, of days with a component of their own."""
    rng = np.random.default_rng(seed)
    day = np.repeat(np.arange(days), runs)
    t = day + np.tile(np.arange(runs) / 24.0, days)
    hall, spindle = 20.0 + rng.normal(size=days)[day], 30.0 + 3.0 * rng.normal(size=len(day))
    u = rng.uniform(0.5, 1.5, len(day))
    y = (
        0.05 * t
        + 1.2 * hall
        - 0.4 * spindle
        + u * rng.normal(size=len(day))
        + between * rng.normal(size=days)[day]
    )
    return y, t, day, {"hall_degC": hall, "spindle_degC": spindle}, u


def design(t, channels):
    return np.column_stack([np.ones_like(t), t - t.mean(), *(x - x.mean() for x in channels.values())])


def test_coefficients_of_independent_runs_are_those_of_statsmodels_ols():
    y, t, _, channels, _ = history(1, 40, 1, 0.0)
    ours = dependence(
        y,
        t,
        channels,
        units=DependenceUnits(MICROMETRE.per(METRE), dict.fromkeys(channels, DEGREE_CELSIUS)),
        independent=True,
    )
    theirs = sm.OLS(y, design(t, channels)).fit()
    found = [ours.drift, *ours.coefficients]
    np.testing.assert_allclose([one.value for one in found], theirs.params[1:], rtol=1e-9)
    np.testing.assert_allclose([one.u for one in found], theirs.bse[1:], rtol=1e-9)
    np.testing.assert_allclose([one.p_value for one in found], theirs.pvalues[1:], rtol=1e-7)
    np.testing.assert_allclose([one.interval for one in found], theirs.conf_int()[1:], rtol=1e-7)
    assert ours.explained == pytest.approx(theirs.rsquared, rel=1e-9)
    assert ours.coefficients[0].unit.name == "µm/m/K"


def test_coefficients_of_weighted_runs_are_those_of_statsmodels_wls():
    y, t, _, channels, u = history(2, 40, 1, 1.0)
    ours = dependence(y, t, channels, u=u, independent=True)
    theirs = sm.WLS(y, design(t, channels), weights=1.0 / (u**2 + ours.between**2)).fit()
    found = [ours.drift, *ours.coefficients]
    # The component between the runs is that with which the weighted squares are as large as they should be.
    assert theirs.scale == pytest.approx(1.0, abs=1e-9)
    np.testing.assert_allclose([one.value for one in found], theirs.params[1:], rtol=1e-8)
    np.testing.assert_allclose([one.u for one in found], theirs.bse[1:], rtol=1e-8)
    np.testing.assert_allclose([one.p_value for one in found], theirs.pvalues[1:], rtol=1e-6)


def test_coefficients_with_a_day_component_are_those_of_statsmodels_gls_and_its_mixed_model():
    y, t, day, channels, u = history(3, 30, 4, 1.5)
    ours = dependence(y, t, channels, u=u, days=day, independent=True)
    same = np.equal.outer(day, day)
    theirs = sm.GLS(y, design(t, channels), np.diag((ours.within * u) ** 2) + ours.between**2 * same).fit()
    found = [ours.drift, *ours.coefficients]
    np.testing.assert_allclose([one.value for one in found], theirs.params[1:], rtol=1e-7)
    np.testing.assert_allclose([one.u for one in found], theirs.bse[1:], rtol=1e-6)
    plain = dependence(y, t, channels, days=day, independent=True)
    # Restricted maximum likelihood weighs the days a little otherwise than moments do: far below one u.
    mixed = sm.MixedLM(y, design(t, channels), groups=day).fit(reml=True)
    for one, value, sd in zip(
        [plain.drift, *plain.coefficients], mixed.fe_params[1:], mixed.bse_fe[1:], strict=True
    ):
        assert abs(one.value - value) < 0.05 * one.u
        assert one.u == pytest.approx(sd, rel=0.05)
    assert plain.between == pytest.approx(float(np.sqrt(mixed.cov_re[0, 0])), rel=0.05)


@pytest.mark.parametrize(("period", "span", "name"), [(1.0, 12.0, "day"), (365.25, 1200.0, "year")])
def test_cycles_are_those_of_a_lomb_scargle_periodogram_with_floating_mean(period, span, name):
    rng = np.random.default_rng(4)
    t = np.sort(rng.uniform(0.0, span, 150))
    y = 7.0 + 2.0 * np.cos(2.0 * np.pi * (t - 0.3 * period) / period) + rng.normal(size=150)
    ours = dependence(y, t, {}, cycles={name: period}, drift=False).cycles[0]
    theirs = signal.lombscargle(
        t, y, [2.0 * np.pi / period], floating_mean=True, normalize="amplitude"
    ).item()
    assert ours.amplitude == pytest.approx(abs(theirs), rel=1e-9)
    at = np.angle(theirs) / (2.0 * np.pi) * period
    assert abs((ours.peak_at - at + 0.5 * period) % period - 0.5 * period) < 1e-9 * span


def test_cycles_beside_a_drift_are_those_of_least_squares_on_sine_and_cosine():
    rng = np.random.default_rng(5)
    t = np.sort(rng.uniform(0.0, 1200.0, 120))
    y = 0.004 * t + 1.5 * np.sin(2.0 * np.pi * t / 365.25) + rng.normal(size=120)
    ours = dependence(y, t, {}, cycles={"year": 365.25})
    (_, slope, a, b), *_ = np.linalg.lstsq(
        np.column_stack([np.ones_like(t), t, np.cos(2 * np.pi * t / 365.25), np.sin(2 * np.pi * t / 365.25)]),
        y,
    )
    assert ours.drift.value == pytest.approx(slope, rel=1e-9)
    assert ours.cycles[0].amplitude == pytest.approx(np.hypot(a, b), rel=1e-9)
    peak = np.arctan2(b, a) / (2.0 * np.pi) * 365.25
    assert (ours.cycles[0].peak_at - peak + 182.625) % 365.25 - 182.625 == pytest.approx(0.0, abs=1e-6)


def test_warm_up_of_hot_cold_is_that_of_curve_fit():
    with HOT_COLD.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    hours = np.array([float(row["hours"]) for row in rows])

    def curve(x, final, amplitude, tau):
        return final + amplitude * np.exp(-(x - hours.min()) / tau)

    for name in ("EXX", "EYY", "EZZ"):
        y = np.array([float(row[name]) for row in rows])
        ours = warm_up(y, hours, rng=np.random.default_rng(6))
        theirs, covariance = optimize.curve_fit(
            curve, hours, y, p0=[y[-5:].mean(), y[0] - y[-5:].mean(), 3.0]
        )
        left = y - curve(hours, *theirs)
        sd = np.sqrt(left @ left / (len(y) - 3))
        u = np.sqrt(np.diag(covariance))
        # Ours is the best of 400 time constants, each 1.6 % longer than the last.
        assert ours.tau == pytest.approx(theirs[2], rel=0.01)
        assert abs(ours.final - theirs[0]) < 0.1 * u[0]
        assert abs(ours.amplitude - theirs[1]) < 0.1 * u[1]
        assert ours.residual_sd == pytest.approx(sd, rel=1e-3)
        stable = hours.min() + theirs[2] * np.log(abs(theirs[1]) / sd)
        assert ours.stable_after == pytest.approx(stable, abs=0.1)
        # The profile is not symmetric; its half width is that of the linearised fit all the same.
        half = 0.5 * (ours.tau_interval[1] - ours.tau_interval[0])
        assert half == pytest.approx(2.02 * u[2], rel=0.25)


@pytest.mark.parametrize(
    ("lam", "width", "published"),
    [
        (0.05, 2.615, [500, 84.1, 28.8, 16.4, 11.4, 7.1, 5.2, 4.2, 3.5, 2.7]),
        (0.10, 2.814, [500, 106, 31.3, 15.9, 10.3, 6.1, 4.4, 3.4, 2.9, 2.2]),
        (0.20, 2.962, [500, 150, 41.8, 18.2, 10.5, 5.5, 3.7, 2.9, 2.4, 1.9]),
        (0.25, 2.998, [500, 170, 48.2, 20.1, 11.1, 5.5, 3.6, 2.7, 2.3, 1.7]),
        (0.40, 3.054, [500, 224, 71.2, 28.4, 14.3, 5.9, 3.5, 2.5, 2.0, 1.4]),
    ],
)
def test_lucas_saccucci_1990_ewma_run_lengths_of_shifts(lam, width, published):
    """As D. C. Montgomery prints them, Introduction to Statistical Quality Control, table of the EWMA schemes."""
    found = ewma_run_length(width, SHIFTS, np.ones_like(SHIFTS), lam)
    # Half a unit of the last digit printed, and the 1 % of limits printed with four digits.
    np.testing.assert_allclose(found, published, rtol=0.01, atol=0.05)


@pytest.mark.parametrize(
    ("h", "published"),
    [
        (4.0, [168, 74.2, 26.6, 13.3, 8.38, 4.75, 3.34, 2.62, 2.19, 1.71]),
        (5.0, [465, 139, 38.0, 17.0, 10.4, 5.75, 4.01, 3.11, 2.57, 2.01]),
    ],
)
def test_lucas_crosier_1982_cusum_run_lengths_of_shifts(h, published):
    found = cusum_run_length(h, SHIFTS, np.ones_like(SHIFTS), 0.5)
    np.testing.assert_allclose(found, published, rtol=0.01)


def test_prabhu_runger_1997_mewma_limit_of_ten_parameters():
    ours = mewma_limit(10, np.inf, 0.1, 200.0, np.random.default_rng(10), trials=4000)
    assert ours == pytest.approx(22.67, rel=0.02)
