"""All tests of homogeneity together, over many coordinates, with the false discovery rate controlled."""

from __future__ import annotations

import numpy as np
import pytest
from statsmodels.stats.multitest import multipletests

from monitor.exceptions import DataError
from monitor.statistics import (
    anova,
    bartlett,
    control_false_discoveries,
    kruskal_wallis,
    levene,
    p_value_histogram,
    welch_anova,
)
from monitor.statistics.homogeneity import homogeneity


def test_homogeneity_holds_what_the_single_tests_say():
    rng = np.random.default_rng(3)
    values, days = rng.normal(size=(20, 186)), np.repeat(np.arange(5), 4)
    result = homogeneity(values, days)
    for field, test in (
        (result.anova, anova),
        (result.welch, welch_anova),
        (result.kruskal, kruskal_wallis),
        (result.bartlett, bartlett),
        (result.levene, levene),
    ):
        np.testing.assert_array_equal(field.p_value, test(values, days).p_value)
    assert result.mean_discoveries.called.sum() == 0


def test_a_group_with_a_single_run_leaves_only_the_tests_that_it_allows():
    result = homogeneity(np.arange(5.0), [1, 1, 2, 2, 3])
    assert (result.bartlett, result.levene, result.welch) == (None, None, None)
    assert np.isfinite(result.anova.p_value).all()


def test_a_step_of_one_day_in_one_parameter_alone_is_called():
    rng = np.random.default_rng(4)
    days = np.repeat(np.arange(1, 6), 4)
    values = rng.normal(size=(20, 13))
    values[days >= 4, 5] += 6.0
    called = homogeneity(values, days).mean_discoveries.called
    np.testing.assert_array_equal(np.flatnonzero(called), [5])


def test_histogram_is_flat_on_null_data_and_piles_up_at_zero_where_days_differ():
    rng = np.random.default_rng(7)
    days = np.repeat(np.arange(5), 4)
    null = p_value_histogram(anova(rng.normal(size=(20, 2000)), days).p_value)
    assert null.expected == 100.0
    chi_square = ((null.counts - null.expected) ** 2 / null.expected).sum()
    assert chi_square < 43.8  # 99.9 % of chi-square with 19 degrees of freedom
    moved = rng.normal(size=(20, 2000)) + np.repeat(rng.normal(size=(5, 2000)), 4, axis=0)
    assert p_value_histogram(anova(moved, days).p_value).counts[0] > 1000
    with pytest.raises(DataError, match="outside 0 to 1"):
        p_value_histogram([0.5, 1.5])
    with pytest.raises(DataError, match="bins is 0"):
        p_value_histogram([0.5], bins=0)


@pytest.mark.parametrize(
    ("ours", "theirs"), [("benjamini-hochberg", "fdr_bh"), ("benjamini-yekutieli", "fdr_by")]
)
def test_q_values_agree_with_statsmodels(ours, theirs):
    rng = np.random.default_rng(8)
    p = np.concatenate([rng.uniform(size=150), rng.uniform(size=36) ** 6, [0.0, 1.0, 0.5, 0.5]])
    result = control_false_discoveries(p, method=ours)
    called, q, _, _ = multipletests(p, 0.05, method=theirs)
    np.testing.assert_allclose(result.q_value, q, rtol=1e-13)
    np.testing.assert_array_equal(result.called, called)


def test_what_could_not_be_tested_is_not_counted():
    result = control_false_discoveries([0.02, np.nan, 0.04])
    np.testing.assert_allclose(result.q_value, [0.04, np.nan, 0.04])
    assert list(result.called) == [True, False, True]
    assert control_false_discoveries([]).q_value.shape == (0,)


def test_false_discovery_rate_is_at_most_as_stated():
    rng = np.random.default_rng(9)
    days = np.repeat(np.arange(5), 4)
    shares = []
    for _ in range(300):
        values = rng.normal(size=(20, 40))
        values[days == 4, :10] += 3.0
        called = homogeneity(values, days, rate=0.1).mean_discoveries.called
        shares.append(called[10:].sum() / max(called.sum(), 1))
    # With 30 of 40 true nulls the rate of Benjamini-Hochberg is 0.75 times 0.1; two tests must agree, so it is below.
    standard_error = np.std(shares) / np.sqrt(len(shares))
    assert 0.01 < np.mean(shares) < 0.075 + 3.3 * standard_error


def test_refusals_say_what_is_needed():
    with pytest.raises(DataError, match=r"p_values\[1\] is 1\.2"):
        control_false_discoveries([0.1, 1.2])
    with pytest.raises(DataError, match=r"rate is 1\.0; it must lie between 0 and 1"):
        control_false_discoveries([0.1], rate=1.0)
    with pytest.raises(DataError, match="method is 'bonferroni'; there are"):
        control_false_discoveries([0.1], method="bonferroni")
    with pytest.raises(DataError, match="one dimension"):
        control_false_discoveries([[0.1]])
