"""Components of variance: coverage with 3 to 6 days, StRD and the e-Handbook check standard."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from monitor.exceptions import DataError
from monitor.statistics import anova, variance_components

TRIALS = 6000


def covered(intervals, truth):
    return int(((intervals[:, 0] <= truth) & (truth <= intervals[:, 1])).sum())


@pytest.mark.parametrize("days", [3, 4, 5, 6])
@pytest.mark.parametrize("ratio", [0.5, 1.0, 3.0])
def test_coverage_with_few_days(days, ratio, rate_agrees):
    rng = np.random.default_rng([days, int(10 * ratio)])
    groups = np.repeat(np.arange(days), 4)
    values = rng.normal(size=(4 * days, TRIALS)) + ratio * rng.normal(size=(days, TRIALS))[groups]
    result = variance_components(values, groups)
    assert rate_agrees(covered(result.within_interval, 1.0), TRIALS, 0.95)
    # The modified large-sample method is nominal to half a per cent (measured with 20 000 trials each); the upper
    # end of u_day misses less often, as that of a negative estimate is that of an estimate of zero.
    count = covered(result.u_run_interval, np.hypot(1, ratio))
    assert rate_agrees(count, TRIALS, 0.945) or rate_agrees(count, TRIALS, 0.955), count / TRIALS
    assert rate_agrees(int((result.between_interval[:, 0] > ratio).sum()), TRIALS, 0.025)
    assert (result.between_interval[:, 1] < ratio).mean() < 0.0275


def test_no_day_component_is_said_as_zero_and_its_interval_includes_zero(rate_agrees):
    groups = np.repeat(np.arange(5), 4)
    values = np.random.default_rng(12).normal(size=(20, TRIALS))
    result = variance_components(values, groups)
    np.testing.assert_array_equal(result.truncated, result.between == 0.0)
    np.testing.assert_array_equal(result.truncated, anova(values, groups).statistic < 1.0)
    assert rate_agrees(int(result.truncated.sum()), TRIALS, 0.5618)  # P(F(4, 15) < 1)
    # One-sided at zero: 97.5 % of the intervals begin there.
    assert rate_agrees(int((result.between_interval[:, 0] == 0.0).sum()), TRIALS, 0.975)


@pytest.mark.parametrize("ratio", [0.05, 0.2])
def test_days_that_differ_by_little_are_never_said_to_be_equal(ratio):
    """An interval of 0 to 0 stated as certain what five days had not shown: 2.5 % of machines without a difference."""
    groups = np.repeat(np.arange(5), 4)
    rng = np.random.default_rng([2611, int(100 * ratio)])
    values = rng.normal(size=(20, TRIALS)) + ratio * rng.normal(size=(5, TRIALS))[groups]
    result = variance_components(values, groups)
    upper = result.between_interval[:, 1]
    # Of an estimate of zero: what E(MS between) may be where it is seen equal to MS within, by chi-square alone.
    by_chi_square = result.within * np.sqrt((4.0 / stats.chi2.ppf(0.025, 4) - 1.0) / 4.0)
    assert upper[result.truncated] == pytest.approx(by_chi_square[result.truncated], rel=0.1)
    assert (upper < ratio).sum() == 0


def test_estimates_are_the_anova_ones_for_equal_groups(strd, certified):
    rows = strd("anova/SiRstv.dat")
    groups, y = [r[0] for r in rows], [float(r[1]) for r in rows]
    right = {
        k: float(v) for k, v in certified("nist-strd/certified_anova.json")["SiRstv"]["certified"].items()
    }
    result = variance_components(y, groups)
    between = (right["MS_between"] - right["MS_within"]) / 5
    assert result.between[0] ** 2 == pytest.approx(between, rel=1e-11)
    assert result.within[0] == pytest.approx(right["residual_sd"], rel=1e-12)
    assert result.u_run[0] ** 2 == pytest.approx(between + right["MS_within"], rel=1e-12)
    assert result.u_mean[0] ** 2 == pytest.approx(right["MS_between"] / 25, rel=1e-12)
    assert result.dof_mean == 4


def test_unequal_groups_keep_the_coverage(rate_agrees):
    rng = np.random.default_rng(13)
    groups = np.repeat(np.arange(5), [2, 4, 6, 3, 5])
    values = rng.normal(size=(20, TRIALS)) + rng.normal(size=(5, TRIALS))[groups]
    result = variance_components(values, groups)
    assert 0.945 < covered(result.between_interval, 1.0) / TRIALS < 0.98


def test_refusals_say_what_is_needed():
    with pytest.raises(DataError, match="level is 95; it must lie between 0 and 1"):
        variance_components(np.arange(6.0), [1, 1, 2, 2, 3, 3], level=95)
    with pytest.raises(DataError, match="2 are needed"):
        variance_components(np.arange(4.0), [1, 1, 1, 1])
