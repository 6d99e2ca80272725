"""Normality within groups: exact level for three runs a day, agreement with Shapiro-Wilk, power."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from monitor.exceptions import DataError
from monitor.statistics.normality import normality


@pytest.mark.parametrize(("days", "runs"), [(5, 4), (4, 3), (1, 20)])
def test_false_alarm_rate(days, runs, rate_agrees):
    rng = np.random.default_rng([days, runs])
    values = 5.0 + rng.normal(size=(days * runs, 10_000))
    p = normality(values, np.repeat(np.arange(days), runs), rng=rng).p_value
    assert rate_agrees(int((p <= 0.05).sum()), 10_000, 0.05)


def test_agrees_with_shapiro_wilk_where_that_applies():
    rng = np.random.default_rng(2)
    values = rng.standard_t(5, size=(40, 60))
    ours = normality(values, rng=rng).p_value
    theirs = stats.shapiro(values, axis=0).pvalue
    assert stats.spearmanr(ours, theirs).statistic > 0.95
    assert np.abs(ours - theirs).mean() < 0.08


def test_one_wild_run_is_seen():
    rng = np.random.default_rng(3)
    values = rng.normal(size=(20, 2))
    values[7, 1] += 9.0
    p = normality(values, np.repeat(np.arange(5), 4), rng=rng).p_value
    assert p[0] > 0.01
    assert p[1] < 0.005


def test_refusals_and_a_constant_column():
    rng = np.random.default_rng(0)
    assert np.isnan(normality(np.ones(6), rng=rng, trials=99).p_value[0])
    with pytest.raises(DataError, match=r"leave 1 degree\(s\) of freedom"):
        normality([1.0, 2.0, 3.0], [1, 1, 2], rng=rng)
    with pytest.raises(DataError, match="trials is 5; at least 99"):
        normality(np.arange(5.0), rng=rng, trials=5)
