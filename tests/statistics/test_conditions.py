"""Dependence on conditions: NIST StRD Longley, coefficients with units, cycles (DZIUBA1), rates."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.statistics import DependenceUnits, dependence
from monitor.units import DEGREE_CELSIUS, METRE, MICROMETRE, Unit


def test_nist_strd_longley(strd, certified, digits):
    rows = np.array(strd("linear/Longley.dat"), dtype=float)
    right = certified("nist-strd/certified_linear.json")["Longley"]["certified"]
    names = [f"x{i}" for i in range(1, 7)]
    # Longley's last regressor is the year: it is the drift's place to be collinear, so no drift beside it.
    regressors = dict(zip(names, rows.T[1:], strict=True))
    result = dependence(rows[:, 0], rows[:, 6], regressors, drift=False, independent=True)
    for ours, value, sd in zip(result.coefficients, right["estimates"][1:], right["sd"][1:], strict=True):
        assert digits(ours.value, value) >= 10
        assert digits(ours.u, sd) >= 10


def test_mpc62_check_standard_does_not_depend_on_temperature(table, certified):
    rows = table("nist-cases/nist_MPC62.DAT", 13)
    right = certified("nist-handbook/check_standard_2_6_2.json")
    assert len(rows) == right["n"]
    result = dependence(
        rows[:, 10], np.arange(25.0), {"temperature": rows[:, 9]}, drift=False, independent=True
    ).coefficients[0]
    assert result.value == pytest.approx(right["temperature_slope"], abs=5e-6)
    assert result.p_value == pytest.approx(right["temperature_p"], abs=5e-4)


def test_coefficient_has_the_unit_of_value_per_channel():
    rng = np.random.default_rng(1)
    temperature = 21.0 + rng.normal(size=40)
    y = 11.5 * temperature + rng.normal(size=40)
    per_metre = MICROMETRE.per(METRE)
    result = dependence(
        y,
        np.arange(40.0),
        {"x_axis_degC": temperature},
        units=DependenceUnits(per_metre, {"x_axis_degC": DEGREE_CELSIUS}),
    )
    assert result.coefficients[0].unit == Unit("µm/m/K", 1e-6)
    assert abs(result.coefficients[0].value - 11.5) < 4 * result.coefficients[0].u
    assert dependence(y, np.arange(40.0), {"x": temperature}).coefficients[0].unit is None


def test_coefficients_within_and_between_days_have_nominal_rates_and_coverage(rate_agrees, seeds):
    rng = np.random.default_rng(2)
    day = np.repeat(np.arange(8), 4)
    t = day + np.tile([0.0, 0.1, 0.2, 0.3], 8)
    trials, alarms, hits = len(seeds(500, 200)), 0, 0
    for _ in range(trials):
        daily, of_run = rng.normal(size=8)[day], rng.normal(size=32)
        y = 0.7 * of_run + rng.normal(size=32) + 1.5 * rng.normal(size=8)[day]
        result = dependence(y, t, {"hall": daily, "spindle": of_run}, days=day)
        hall, spindle = result.coefficients
        alarms += hall.p_value < 0.05
        hits += spindle.interval[0] <= 0.7 <= spindle.interval[1]
    # What varies from day to day is judged with days that may resemble each other: fewer alarms than for independent.
    assert 0.005 < alarms / trials < 0.05
    assert rate_agrees(hits, trials, 0.95), hits / trials


def test_day_and_year_cycles_are_found_with_amplitude_and_peak():
    rng = np.random.default_rng(3)
    t = np.sort(rng.uniform(0.0, 3 * 365.25, 400))
    y = 3.0 * np.cos(2 * np.pi * (t - 40.0) / 365.25) + rng.normal(size=400)
    result = dependence(y, t, {}, cycles={"year": 365.25, "day": 1.0})
    year, day = result.cycles
    assert abs(year.amplitude - 3.0) < 4 * year.u
    assert abs((year.peak_at - 40.0 + 182.625) % 365.25 - 182.625) < 8.0
    # 30 blocks of a tenth of a year: their few degrees of freedom say no more.
    assert year.p_value < 1e-12
    assert day.p_value > 0.001


def test_dziuba1_has_a_yearly_cycle_beside_its_drift(table):
    rows = table("nist-cases/nist_DZIUBA1.DAT", 4)
    assert len(rows) == 1000
    years = rows[:, 2] + (rows[:, 0] - 1) / 12 + (rows[:, 1] - 1) / 365.25
    result = dependence(rows[:, 3], years, {}, cycles={"year": 1.0})
    # 41.1 mohm a year and an amplitude of 7.3 mohm: shared recomputation of the same model.
    assert result.drift.value == pytest.approx(0.0411, abs=0.0006)
    assert result.cycles[0].amplitude == pytest.approx(0.0073, abs=0.0008)
    # A cycle among weeks that resemble each other.
    assert result.cycles[0].p_value < 0.05
    independent = dependence(rows[:, 3], years, {}, cycles={"year": 1.0}, independent=True)
    assert independent.cycles[0].p_value < 1e-20


def test_drift_and_an_ever_warmer_channel_are_told_apart_or_said_to_be_one():
    t = np.arange(30.0)
    with pytest.raises(DataError, match="exactly dependent over these runs"):
        dependence(np.sin(t), t, {"ambient": 20.0 + 0.1 * t})
    close = 20.0 + 0.1 * t + 0.01 * np.sin(t)
    result = dependence(np.sin(3 * t), t, {"ambient": close})
    assert abs(result.correlation[1, 2]) > 0.99


def test_drift_that_is_not_reported_changes_no_other_number():
    rng = np.random.default_rng(11)
    t = np.repeat(np.arange(12.0), 3) + np.tile([0.1, 0.2, 0.3], 12)
    ambient = 20.0 + rng.normal(size=36)
    values = 0.3 * ambient + 0.1 * t + np.repeat(rng.normal(size=12), 3) + rng.normal(size=36)
    for channels, cycles in (({"ambient": ambient}, None), ({}, {"day": 1.0})):
        reported = dependence(values, t, channels, cycles=cycles, days=t.astype(int))
        beside = dependence(values, t, channels, cycles=cycles, days=t.astype(int), drift="beside")
        assert reported.drift is not None
        assert beside.drift is None
        assert beside.coefficients == reported.coefficients
        assert beside.cycles == reported.cycles
        assert beside.terms == reported.terms


def test_refusals_say_what_is_needed():
    t = np.arange(10.0)
    with pytest.raises(DataError, match=r"channel ambient is 20\.0 in every run"):
        dependence(np.sin(t), t, {"ambient": np.full(10, 20.0)})
    with pytest.raises(DataError, match=r"cycle year has period 365\.25; the times span 9\.0"):
        dependence(np.sin(t), t, {}, cycles={"year": 365.25})
    with pytest.raises(DataError, match="channel x has 3 values; 10 are needed"):
        dependence(np.sin(t), t, {"x": [1.0, 2.0, 3.0]})
