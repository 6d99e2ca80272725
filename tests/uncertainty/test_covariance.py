"""Covariance of the inputs from repeated runs (GUM 4.2, H.2; Los 2017 chapter 5), and its singular cases."""

import math

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.uncertainty import (
    Inputs,
    effective_dof,
    joined,
    overall,
    pooled_by_day,
    uncorrelated,
)
from monitor.uncertainty.roots import covariance_root, whitening

NAMES, UNITS = ("a", "b"), ("mm", "mm")
DAYS = np.array([1, 1, 1, 2, 2, 3])
VALUES = np.array([[1.0, 2.0], [2.0, 1.0], [3.0, 3.0], [11.0, 5.0], [13.0, 7.0], [0.0, 0.0]])


def test_gum_h2_correlation_of_repeated_observations(gum, references):
    published = gum("gum_H2")["published"]
    data = np.loadtxt(references / "gum" / "gum_H2_data.csv", delimiter=",", skiprows=1)
    data[:, 1] *= 1e-3
    inputs = overall(data, ("V", "I", "phi"), ("V", "A", "rad"), mean_of=len(data))
    assert inputs.estimate == pytest.approx(published["mean"], rel=1e-9)
    assert inputs.u == pytest.approx(published["s_mean"], rel=0.02)
    assert np.round(inputs.correlation[0], 2) == pytest.approx(
        [1.0, published["r_V_I"], published["r_V_phi"]]
    )
    assert inputs.correlation[1, 2] == pytest.approx(published["r_I_phi"], abs=5e-3)
    assert inputs.dof["repeated runs"] == 4


def test_pooled_by_day_weights_days_by_their_degrees_of_freedom():
    pooled = pooled_by_day(VALUES, DAYS, NAMES, UNITS)
    first = np.cov(VALUES[:3], rowvar=False)
    second = np.cov(VALUES[3:5], rowvar=False)
    assert pooled.covariance == pytest.approx((2 * first + 1 * second) / 3)
    assert pooled.dof["repeated runs"] == 3
    assert pooled.estimate == pytest.approx(VALUES.mean(axis=0))
    assert overall(VALUES, NAMES, UNITS).covariance == pytest.approx(np.cov(VALUES, rowvar=False))


def test_los_2017_e35_overall_over_pooled_variance_with_five_days_of_four():
    # u_all² / u_pooled² = (15 + 4 F) / 19 with F the ANOVA ratio (erratum E35).
    rng = np.random.default_rng(3)
    days = np.repeat(np.arange(5), 4)
    values = rng.standard_normal((20, 1)) + 2.0 * rng.standard_normal((5, 1))[days]
    between = 4 * np.var([values[days == d].mean() for d in range(5)], ddof=1)
    pooled = pooled_by_day(values, days, ("x",), ("mm",)).covariance[0, 0]
    every = overall(values, ("x",), ("mm",)).covariance[0, 0]
    assert every / pooled == pytest.approx((15 + 4 * between / pooled) / 19, rel=1e-12)


def test_scale_bar_joins_uncorrelated():
    probing = overall(VALUES, NAMES, UNITS, source="probing")
    bar = uncorrelated(("bar",), ("mm",), [300.0], [0.0012], source="scale bar")
    inputs = joined(probing, bar)
    assert inputs.covariance[2] == pytest.approx([0.0, 0.0, 0.0012**2])
    assert inputs.source_names == ("probing", "scale bar")
    assert inputs.degrees_of_freedom("probing") == 5
    assert inputs.degrees_of_freedom("scale bar") == math.inf
    with pytest.raises(DataError, match="both name the source 'probing'"):
        joined(probing, probing)


def test_fewer_runs_than_coordinates_leave_the_rank_of_the_runs():
    values = np.random.default_rng(4).standard_normal((44, 187)) * np.logspace(-6, 3, 187)
    inputs = overall(values, tuple(map(str, range(187))), ("mm",) * 187)
    root = covariance_root(inputs.covariance)
    assert inputs.rank == root.rank == 43
    scale = np.sqrt(np.outer(np.diag(inputs.covariance), np.diag(inputs.covariance)))
    assert np.max(np.abs(root.root @ root.root.T - inputs.covariance) / scale) < 1e-13
    white = root.whitener @ inputs.covariance @ root.whitener.T
    assert white == pytest.approx(np.eye(43), abs=1e-9)


def test_whitening_by_cholesky_and_by_eigenvectors_measure_the_same_distance():
    rng = np.random.default_rng(6)
    values = rng.standard_normal((50, 5)) @ rng.standard_normal((5, 5))
    covariance = np.cov(values, rowvar=False)
    point = rng.standard_normal(5)
    cholesky = np.linalg.norm(whitening(covariance) @ point)
    assert cholesky == pytest.approx(np.linalg.norm(covariance_root(covariance).whitener @ point), rel=1e-9)


def test_gum_g_4_welch_satterthwaite_is_the_case_of_one_output():
    # u_1 = 3 with 4, u_2 = 4 with 10 degrees of freedom: 625 / (81/4 + 256/10).
    parts = [np.array([[9.0]]), np.array([[16.0]])]
    assert effective_dof(parts, [4.0, 10.0]) == pytest.approx(625 / (81 / 4 + 256 / 10))
    assert effective_dof(parts, [math.inf, math.inf]) == math.inf


def test_effective_degrees_of_freedom_do_not_depend_on_units():
    rng = np.random.default_rng(7)
    parts = [np.cov(rng.standard_normal((9, 3)), rowvar=False) for _ in range(2)]
    mix = rng.standard_normal((3, 3))
    mixed = [mix @ part @ mix.T for part in parts]
    assert effective_dof(mixed, [8, 3]) == pytest.approx(effective_dof(parts, [8, 3]), rel=1e-9)
    assert effective_dof(parts[:1], [8]) == pytest.approx(8.0)


def test_refusals_of_inputs():
    with pytest.raises(DataError, match=r"at least two runs, but there is 1"):
        overall(VALUES[:1], NAMES, UNITS)
    with pytest.raises(DataError, match=r"every day has a single run"):
        pooled_by_day(VALUES, np.arange(6), NAMES, UNITS)
    with pytest.raises(DataError, match=r"run row 2 has no finite b"):
        overall(np.array([[1.0, 2.0], [1.0, np.nan]]), NAMES, UNITS)
    with pytest.raises(DataError, match=r"come twice: a"):
        overall(VALUES, ("a", "a"), UNITS)
    with pytest.raises(DataError, match=r"not positive semidefinite"):
        covariance_root(np.array([[1.0, 2.0], [2.0, 1.0]]))
    with pytest.raises(DataError, match=r"2 inputs need 2 sources, but 1 are given"):
        Inputs(NAMES, UNITS, np.zeros(2), np.eye(2), ("one",))
