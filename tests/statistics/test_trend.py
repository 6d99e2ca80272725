"""Trends: NIST StRD Norris, weighted least squares of statsmodels, rates with day components, Mann-Kendall."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
import statsmodels.api as sm
from scipy import stats

from monitor.exceptions import DataError
from monitor.statistics import mann_kendall
from monitor.statistics.monotone import _ranks
from monitor.statistics.trend import trend


def test_nist_strd_norris(strd, certified, digits):
    rows = np.array(strd("linear/Norris.dat"), dtype=float)
    right = certified("nist-strd/certified_linear.json")["Norris"]["certified"]
    order = np.argsort(rows[:, 1], kind="stable")
    y, x = rows[order].T
    # Norris holds almost equal abscissae: an ordinary line, no day component possible.
    result = trend(y, x, independent=True)
    assert digits(result.slope, right["estimates"][1]) >= 12
    assert digits(result.u_slope, right["sd"][1]) >= 12
    assert digits(result.level_at - result.slope * result.at, right["estimates"][0]) >= 11


def test_weighted_line_agrees_with_statsmodels():
    rng = np.random.default_rng(1)
    t, u = np.arange(12.0), rng.uniform(0.5, 2.0, 12)
    y = 0.3 * t + rng.normal(size=12) * u * 0.1
    result = trend(y, t, u=u, independent=True)
    # Weights that explain the scatter: no day component is left and the line is plain weighted least squares.
    right = sm.WLS(y, sm.add_constant(t), weights=u**-2).fit()
    assert result.between == 0.0
    assert result.slope == pytest.approx(right.params[1], rel=1e-11)
    assert result.u_slope == pytest.approx(right.bse[1], rel=1e-10)


def test_robust_slope_is_theil_sen_and_ignores_a_wild_day():
    t = np.arange(15.0)
    y = 2.0 * t + np.random.default_rng(2).normal(size=15) * 0.1
    y[14] -= 40.0
    result = trend(y, t)
    scipys = stats.theilslopes(y, t, alpha=0.95)
    assert result.robust_slope == scipys.slope
    # Of days that resemble each other it is wider.
    low, high = result.robust_interval
    assert low <= scipys.low_slope < scipys.high_slope <= high
    assert result.robust_interval[0] < 2.0 < result.robust_interval[1]
    assert result.slope < 1.8


@pytest.mark.parametrize(
    ("days", "runs", "between", "spread", "level"),
    [(5, 4, 1.0, 0.0, 0.05), (12, 4, 1.0, 0.5, 0.05), (30, 1, 0.0, 0.5, 0.05), (40, 4, 2.0, 0.5, 0.05)],
)
def test_false_alarm_rate_independent_heteroscedastic_day_component(
    days, runs, between, spread, level, rate_agrees
):
    rng = np.random.default_rng([days, runs])
    trials = 600
    day = np.repeat(np.arange(days), runs)
    t = 7.0 * day + np.tile(0.05 * np.arange(runs), days)
    alarms = 0
    for _ in range(trials):
        u = np.exp(spread * rng.normal(size=len(day)))
        y = rng.normal(size=len(day)) * u + between * rng.normal(size=days)[day]
        line = trend(y, t, u=u, days=day if runs > 1 else None, independent=True, robust=False)
        alarms += line.p_value < 0.05
    assert rate_agrees(alarms, trials, level), alarms / trials


def test_without_the_day_component_the_rate_would_be_five_times_as_large():
    rng = np.random.default_rng(6)
    day = np.repeat(np.arange(6), 4)
    t = 7.0 * day + np.tile(0.05 * np.arange(4), 6)
    plain = with_days = 0
    for _ in range(300):
        y = rng.normal(size=24) + 2.0 * rng.normal(size=6)[day]
        plain += stats.linregress(t, y).pvalue < 0.05
        with_days += trend(y, t, days=day).p_value < 0.05
    assert plain > 75
    assert with_days < 27


def test_slope_interval_covers(rate_agrees):
    rng = np.random.default_rng(7)
    day = np.repeat(np.arange(10), 3)
    t = 7.0 * day + np.tile(0.05 * np.arange(3), 10)
    hits = 0
    for _ in range(500):
        y = 0.3 * t + rng.normal(size=30) + rng.normal(size=10)[day]
        low, high = trend(y, t, days=day, independent=True).slope_interval
        hits += low <= 0.3 <= high
    assert rate_agrees(hits, 500, 0.95)


def test_what_happens_within_a_day_is_no_drift_of_years():
    # 24 weekly days of three runs, then one long day in which the machine warms up by 1.5: no drift. A slope common
    # to hours and weeks would be 1.1 a day (400 a year) with a day component of 70.
    rng = np.random.default_rng(12)
    day = np.concatenate([np.repeat(np.arange(24), 3), np.full(44, 24)])
    hours = np.concatenate([np.tile(np.arange(3.0), 24), np.linspace(0.0, 23.0, 44)])
    y = 0.2 * rng.normal(size=len(day)) + np.where(day == 24, 1.5 * hours / 23.0 - 0.75, 0.0)
    result = trend(y, 7.0 * day + hours / 24.0, days=day)
    assert abs(result.slope) < 3 * result.u_slope < 0.01
    assert result.between < 0.3


def first_order(rng, n, r):
    e = rng.normal(size=n)
    e[0] /= np.sqrt(1 - r * r)
    for i in range(1, n):
        e[i] += r * e[i - 1]
    return e


@pytest.mark.parametrize(("n", "r"), [(100, 0.0), (100, 0.6), (20, 0.0), (20, 0.3), (20, 0.6), (10, 0.6)])
def test_mann_kendall_false_alarm_rate_with_autocorrelation(n, r, rate_at_most):
    rng = np.random.default_rng([n, int(10 * r)])
    trials = 300 if n == 100 else 600
    results = [mann_kendall(first_order(rng, n, r), np.arange(n)) for _ in range(trials)]
    assert rate_at_most(sum(m.p_value < 0.05 for m in results), trials, 0.05)
    if r == 0.6:
        assert sum(m.p_value_independent < 0.05 for m in results) > 0.12 * trials


def test_mann_kendall_still_sees_a_drift():
    # Five standard deviations over 20 values; measured with 750 others: 0.94 independent, 0.72 at r = 0.3.
    rng = np.random.default_rng(10)
    for r, least in ((0.0, 0.88), (0.3, 0.6)):
        found = [
            mann_kendall(first_order(rng, 20, r) + 0.25 * np.arange(20), np.arange(20)) for _ in range(200)
        ]
        assert sum(m.p_value < 0.05 for m in found) / 200 > least


def test_mann_kendall_without_correlation_agrees_with_kendalls_tau():
    rng = np.random.default_rng(9)
    y = np.round(rng.normal(size=60) + 0.02 * np.arange(60), 1)
    result = mann_kendall(y, np.arange(60))
    sign = np.sign(np.subtract.outer(y, y))
    assert result.s == -int(np.triu(sign, 1).sum())
    right = stats.kendalltau(np.arange(60), y, method="asymptotic")
    # scipy makes no continuity correction: the z values differ by 1 in S.
    z, z_scipy = (stats.norm.isf(p / 2) for p in (result.p_value_independent, right.pvalue))
    assert z / z_scipy == pytest.approx((result.s - 1) / result.s, rel=1e-9)


def test_refusals_say_what_is_needed():
    with pytest.raises(DataError, match=r"a trend over 2 day\(s\).*at least 3"):
        trend(np.arange(4.0), np.arange(4.0), days=[1, 1, 2, 2])
    with pytest.raises(DataError, match=r"all times are 1\.0"):
        trend(np.arange(4.0), np.ones(4))
    with pytest.raises(DataError, match=r"u\[1\] is 0\.0; every value must be above zero"):
        trend(np.arange(3.0), np.arange(3.0), u=[1.0, 0.0, 1.0])
    with pytest.raises(DataError, match="times falls or repeats at index 2"):
        mann_kendall(np.arange(6.0), [0, 1, 1, 2, 3, 4])
    with pytest.raises(DataError, match="at least 6 are needed"):
        mann_kendall(np.arange(3.0), np.arange(3.0))


def test_without_ranks_the_line_is_the_same():
    rng = np.random.default_rng(8)
    day = np.repeat(np.arange(20), 3)
    t = day + np.tile([0.0, 0.1, 0.2], 20)
    y, u = 0.1 * t + rng.normal(size=60), rng.uniform(0.5, 1.0, 60)
    whole, line = (trend(y, t, u=u, days=day, robust=robust) for robust in (True, False))
    assert np.isnan(line.robust_slope)
    assert (line.robust_interval, line.monotone) == (None, None)
    ranked = {"robust_slope", "robust_interval", "monotone", "covariance", "common"}
    for field in {field.name for field in fields(whole)} - ranked:
        assert getattr(whole, field) == getattr(line, field), field
    assert np.array_equal(whole.covariance, line.covariance)


def test_ranks_share_ties_as_those_of_scipy():
    values = np.random.default_rng(9).integers(0, 12, 40).astype(float)
    assert np.array_equal(_ranks(values), stats.rankdata(values))
