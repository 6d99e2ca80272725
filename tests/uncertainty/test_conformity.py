"""Probability of conformity: JCGM 106 examples, scipy's own integral, plain draws."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from monitor.exceptions import DataError
from monitor.uncertainty.conformity import conformity


def test_jcgm106_7_4_one_sided_limit_is_the_normal_integral() -> None:
    # T_U = 10, y = 8.5, u = 1: p_c = Phi(1.5) = 0.9332 (table of the normal distribution).
    found = conformity([8.5], [[1.0]], [-math.inf], [10.0])
    assert found.single[0] == pytest.approx(0.9331928, abs=1e-7)
    assert found.joint == found.single[0]


def test_jcgm106_7_4_two_sided_limits_at_the_middle() -> None:
    found = conformity([0.0, 0.0], np.eye(2), [-2.0, -2.0], [2.0, 2.0])
    assert found.single == pytest.approx([0.9544997] * 2, abs=1e-7)
    assert found.joint == pytest.approx(0.9544997**2, abs=3e-4)


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9])
def test_joint_agrees_with_the_integral_of_scipy(rho: float) -> None:
    m = 6
    covariance = np.full((m, m), rho) + (1 - rho) * np.eye(m)
    y, high = np.linspace(-0.5, 0.5, m), np.linspace(1.2, 2.4, m)
    found = conformity(y, covariance, -high, high)
    outside = stats.multivariate_normal(y, covariance).cdf(high, lower_limit=-high)
    assert found.joint == pytest.approx(float(outside), abs=5e-4)
    assert found.joint_standard_error < 5e-4


def test_joint_of_a_singular_covariance_agrees_with_draws() -> None:
    rng = np.random.default_rng(3)
    root = rng.normal(size=(5, 3))
    y = root @ rng.normal(size=3) * 0.3
    high = np.full(5, 2.5)
    draws = y + rng.normal(size=(400_000, 3)) @ root.T
    plain = np.mean((np.abs(draws) <= high).all(axis=1))
    found = conformity(y, root @ root.T, -high, high)
    assert found.joint == pytest.approx(float(plain), abs=5 * math.sqrt(plain * (1 - plain) / 400_000) + 1e-3)


def test_every_parameter_is_judged_with_its_own_degrees_of_freedom() -> None:
    found = conformity([0.0, 0.0], np.eye(2), [-2.0, -2.0], [2.0, 2.0], dof=[5.0, math.inf])
    assert found.single[0] == pytest.approx(float(stats.t(5).cdf(2.0) - stats.t(5).cdf(-2.0)), abs=1e-12)
    assert found.single[1] == pytest.approx(0.9544997, abs=1e-7)
    both = conformity([0.0, 0.0], np.eye(2), [-2.0, -2.0], [2.0, 2.0], dof=5.0)
    assert found.joint == pytest.approx(both.joint, abs=1e-12)


def test_few_degrees_of_freedom_give_the_multivariate_t() -> None:
    rng = np.random.default_rng(4)
    covariance = np.array([[1.0, 0.6], [0.6, 1.0]])
    draws = rng.normal(size=(400_000, 2)) @ np.linalg.cholesky(covariance).T
    draws /= np.sqrt(rng.chisquare(7, size=400_000) / 7)[:, np.newaxis]
    plain = float(np.mean((np.abs(draws) <= 2.0).all(axis=1)))
    found = conformity([0.0, 0.0], covariance, [-2.0, -2.0], [2.0, 2.0], dof=7)
    assert found.joint == pytest.approx(plain, abs=4e-3)
    assert found.single[0] == pytest.approx(float(stats.t(7).cdf(2.0) - stats.t(7).cdf(-2.0)), abs=1e-12)


def test_outputs_without_limits_take_no_part() -> None:
    inf = math.inf
    with_one = conformity([1.0, 5.0], np.eye(2), [-2.0, -inf], [2.0, inf])
    alone = conformity([1.0], [[1.0]], [-2.0], [2.0])
    assert with_one.joint == alone.joint
    assert with_one.single[1] == 1.0


def test_the_same_numbers_give_the_same_probability() -> None:
    arguments = ([0.1, 0.2, 0.3], np.eye(3) + 0.4, [-2.0] * 3, [2.0] * 3)
    assert conformity(*arguments).joint == conformity(*arguments).joint


def test_what_cannot_be_judged_is_refused() -> None:
    with pytest.raises(DataError, match="must lie below"):
        conformity([0.0], [[1.0]], [1.0], [1.0])
    with pytest.raises(DataError, match=r"1 outputs need a covariance \(1, 1\)"):
        conformity([0.0], np.eye(2), [-1.0], [1.0])
    with pytest.raises(DataError, match="variances positive"):
        conformity([0.0], [[0.0]], [-1.0], [1.0])
    with pytest.raises(DataError, match="degrees of freedom must be positive"):
        conformity([0.0], [[1.0]], [-1.0], [1.0], dof=0)


@pytest.mark.parametrize("dof", [3, 8, 15])
def test_a_verdict_of_few_degrees_of_freedom_is_wrong_no_more_often_than_it_says(dof: int) -> None:
    """The machine lies at its limit; u is estimated with ``dof``, as a verdict of few runs has it."""
    rng = np.random.default_rng(dof)
    passed = normal = 0
    for _ in range(2000):
        u2 = rng.chisquare(dof) / dof
        y = 20.0 + rng.normal()
        passed += conformity([y], [[u2]], [-20.0], [20.0], dof=float(dof)).single[0] >= 0.95
        normal += conformity([y], [[u2]], [-20.0], [20.0]).single[0] >= 0.95
    assert 0.035 < passed / 2000 < 0.065
    # As known, the same u would pass more of them: the degrees of freedom are what holds the rate.
    assert normal > passed + 10
