"""MANOVA, Hotelling and Box's M against statsmodels, their rates, and their plain refusals."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from statsmodels.multivariate.manova import MANOVA
from statsmodels.stats.multivariate import (
    test_cov_oneway as statsmodels_box_m,
    test_mvmean_2indep as statsmodels_hotelling,
)

from monitor.exceptions import DataError
from monitor.statistics import box_m, manova


@pytest.fixture
def days():
    rng = np.random.default_rng(4)
    labels = np.repeat([1, 2, 3, 4], [8, 9, 7, 10])
    return rng.normal(size=(34, 3)) @ rng.normal(size=(3, 3)) + 0.2 * labels[:, None], labels


def test_manova_agrees_with_statsmodels(days):
    values, labels = days
    frame = pd.DataFrame(values, columns=["a", "b", "c"]).assign(day=labels)
    right = (
        MANOVA.from_formula("a + b + c ~ C(day)", frame)
        .mv_test()
        .results["C(day)"]["stat"]
        .loc["Wilks' lambda"]
    )
    result = manova(values * [1.0, 1e-6, 1e6], labels)
    assert result.statistic == pytest.approx(float(right["Value"]), rel=1e-10)
    assert result.f == pytest.approx(float(right["F Value"]), rel=1e-9)
    assert result.dof_denominator == pytest.approx(float(right["Den DF"]), rel=1e-12)
    assert result.p_value == pytest.approx(float(right["Pr > F"]), rel=1e-8)


def test_two_groups_are_hotellings_t_squared(days):
    values, labels = days
    chosen = labels <= 2
    right = statsmodels_hotelling(values[labels == 1], values[labels == 2])
    result = manova(values[chosen], labels[chosen])
    assert result.name == "Hotelling T²"
    assert result.f == pytest.approx(right.statistic, rel=1e-10)
    assert result.p_value == pytest.approx(right.pvalue, rel=1e-9)


def test_box_m_agrees_with_statsmodels(days):
    values, labels = days
    covariances = [np.cov(values[labels == d].T) for d in (1, 2, 3, 4)]
    right = statsmodels_box_m(covariances, [8, 9, 7, 10])
    result = box_m(values, labels)
    assert result.f == pytest.approx(right.statistic_f, rel=1e-9)
    assert result.p_value == pytest.approx(right.pvalue_f, rel=1e-8)


def test_false_alarm_rates(rate_agrees):
    rng = np.random.default_rng(5)
    labels = np.repeat(np.arange(5), 8)
    trials = 1500
    draws = rng.normal(size=(trials, 40, 4))
    means = sum(manova(y, labels).p_value < 0.05 for y in draws)
    scatter = sum(box_m(y, labels).p_value < 0.05 for y in draws)
    assert rate_agrees(means, trials, 0.05)
    assert rate_agrees(scatter, trials, 0.05)


def test_five_days_of_four_runs_do_not_suffice_for_box_m_and_it_says_so():
    labels = np.repeat(np.arange(5), 4)
    values = np.random.default_rng(6).normal(size=(20, 13))
    with pytest.raises(DataError, match=r"group 0 has 4 runs for 13 parameters.*At least 14 runs.*at most 3"):
        box_m(values, labels)
    assert 0.0 < manova(values, labels).p_value < 1.0
    with pytest.raises(DataError, match=r"15 degrees of freedom for 16 parameters: at least 21 runs"):
        manova(np.random.default_rng(6).normal(size=(20, 16)), labels)
    values[:, 2] = values[:, 0] + values[:, 1]
    with pytest.raises(DataError, match="exactly dependent"):
        manova(values, labels)
