"""Pooling: the identity of thesis 5.7.1, StRD univariate, matrices against numpy and against each other."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.statistics import anova, pool

# Digits of mean and standard deviation against the certified values, as reached (floored).
REACHED = {
    "Lew": (15, 15),
    "Lottery": (15, 15),
    "Mavro": (15, 13),
    "Michelso": (15, 13),
    "NumAcc1": (15, 15),
    "NumAcc2": (15, 15),
    "NumAcc3": (15, 9),
    "NumAcc4": (15, 8),
}


@pytest.mark.parametrize("name", REACHED)
def test_nist_strd_univariate(name, strd, certified, digits):
    right = certified("nist-strd/certified_univariate.json")[name]["certified"]
    y = np.array([float(r[0]) for r in strd(f"univariate/{name}.dat")])
    result = pool(y, np.zeros(len(y), dtype=int))
    assert digits(result.mean[0], right["mean"]) >= REACHED[name][0]
    assert digits(result.u_all[0], right["sd"]) >= REACHED[name][1]
    assert result.u_all[0] == pytest.approx(result.u_pooled[0], rel=1e-14)


@pytest.fixture
def five_days():
    rng = np.random.default_rng(20170501)
    days = np.repeat(np.arange(1, 6), 4)
    mixing = rng.normal(size=(13, 13))
    values = rng.normal(size=(20, 13)) @ mixing + np.repeat(rng.normal(size=(5, 13)), 4, axis=0)
    return values, days


def test_los_5_7_1_identity_of_u_all_u_pooled_and_ms_between(five_days):
    values, days = five_days
    result, analysis = pool(values, days), anova(values, days)
    assert (result.dof_all, result.dof_pooled) == (19, 15)
    np.testing.assert_allclose(
        19 * result.u_all**2, 15 * result.u_pooled**2 + 4 * analysis.ms_between, rtol=1e-13
    )
    np.testing.assert_array_equal(result.u_all < result.u_pooled, analysis.statistic < 1.0)


def test_covariances_agree_with_numpy_and_the_same_identity_holds_for_the_matrices(five_days):
    values, days = five_days
    result = pool(values, days, [f"p{j}" for j in range(13)])
    np.testing.assert_allclose(result.covariance_all.matrix, np.cov(values.T), rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(result.covariance_all.correlation, np.corrcoef(values.T), atol=1e-13)
    by_day = [np.cov(values[days == d].T) for d in range(1, 6)]
    for ours, theirs in zip(result.covariance_by_group, by_day, strict=True):
        np.testing.assert_allclose(ours.matrix, theirs, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(result.covariance_pooled.matrix, np.mean(by_day, axis=0), atol=1e-12)
    means = np.array([values[days == d].mean(axis=0) for d in range(1, 6)])
    between = 4 * np.cov(means.T)
    np.testing.assert_allclose(
        19 * result.covariance_all.matrix, 15 * result.covariance_pooled.matrix + 4 * between, atol=1e-11
    )
    np.testing.assert_allclose(result.covariance_pooled.u, result.u_pooled, rtol=1e-13)
    assert np.linalg.matrix_rank(result.covariance_by_group[0].matrix) == 3


def test_pooling_weighs_each_group_by_its_degrees_of_freedom():
    values, groups = [0.0, 2.0, 10.0, 13.0, 16.0, 99.0], ["a", "a", "b", "b", "b", "c"]
    result = pool(values, groups)
    assert result.labels == ("a", "b", "c")
    assert result.u_pooled[0] ** 2 == pytest.approx((1 * 2.0 + 2 * 9.0) / 3, rel=1e-14)
    assert np.isnan(result.u_by_group[2, 0])
    assert result.covariance_by_group[2] is None
    assert list(result.counts - 1) == [1, 2, 0]


def test_a_quantity_that_never_varies_has_no_correlation():
    values = np.column_stack([np.arange(4.0), np.full(4, 5.0)])
    correlation = pool(values, [1, 1, 2, 2]).covariance_all.correlation
    assert correlation[0, 0] == 1.0
    assert np.isnan(correlation[1]).all()


def test_refusals_say_what_is_needed():
    with pytest.raises(DataError, match="names has 1 entries; values has 2 columns"):
        pool(np.ones((4, 2)), [1, 1, 2, 2], ["one"])
    with pytest.raises(DataError, match="names holds 'x' twice"):
        pool(np.ones((4, 2)), [1, 1, 2, 2], ["x", "x"])
    with pytest.raises(DataError, match="at least 2 runs are needed"):
        pool([1.0], [1])
