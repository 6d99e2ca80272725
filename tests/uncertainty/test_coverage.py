"""Coverage factors against exact tables (JCGM 102:2011 6.5 and 7.7)."""

import math

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.uncertainty import (
    correlated_rectangle_factor,
    ellipsoid_factor,
    joint_coverage,
    rectangle_factor,
    single_factor,
)
from monitor.uncertainty.coverage_regions.coverage import (
    largest_deviations,
    mahalanobis_distances,
    quantile_of,
)


def equicorrelated(m, rho):
    return np.full((m, m), rho) + (1.0 - rho) * np.eye(m)


@pytest.mark.parametrize("p", ["0.9", "0.95", "0.99"])
def test_jcgm102_6_5_factors_for_1_to_40_outputs_to_seven_digits(gum, p):
    table = gum("coverage_factors")["table"][p]
    assert len(table) == 40
    for m, row in table.items():
        assert ellipsoid_factor(int(m), float(p)) == pytest.approx(row["k_p"], abs=6e-8)
        assert rectangle_factor(int(m), float(p)) == pytest.approx(row["k_q_bonferroni"], abs=6e-8)
        independent = rectangle_factor(int(m), float(p), form="independent")
        assert independent == pytest.approx(row["k_q_sidak"], abs=6e-8)


def test_los_2017_table_7_3_framework_column_is_for_29_outputs():
    # Erratum E29: k_p = 6.52 and k_q = 3.13 belong to 29 outputs, whichever form of k_q is meant.
    assert round(ellipsoid_factor(29), 2) == 6.52
    assert round(rectangle_factor(29), 2) == 3.13
    assert round(rectangle_factor(29, form="independent"), 2) == 3.13


def test_hotelling_with_20_degrees_of_freedom():
    # F quantiles of printed tables: F(2, 19) = 3.522; the other two computed independently of the project.
    assert ellipsoid_factor(2, dof=20) == pytest.approx(math.sqrt(2 * 20 / 19 * 3.522), abs=2e-4)
    assert ellipsoid_factor(8, dof=20) == pytest.approx(5.84, abs=5e-3)
    assert ellipsoid_factor(13, dof=20) == pytest.approx(10.3, abs=5e-2)


def test_hotelling_needs_as_many_degrees_of_freedom_as_outputs():
    assert ellipsoid_factor(13, dof=12) == math.inf
    assert ellipsoid_factor(13, dof=13) < math.inf
    assert ellipsoid_factor(13, dof=1e9) == pytest.approx(ellipsoid_factor(13), rel=1e-6)


def test_hotelling_covers_by_simulation():
    rng = np.random.default_rng(5)
    m, dof, repeats = 3, 12, 4000
    inside = 0
    for _ in range(repeats):
        noise = rng.standard_normal((dof, m))
        deviation = rng.standard_normal(m)
        distance = math.sqrt(deviation @ np.linalg.solve(noise.T @ noise / dof, deviation))
        inside += distance <= ellipsoid_factor(m, 0.95, dof)
    # Binomial standard deviation 0.0034.
    assert inside / repeats == pytest.approx(0.95, abs=0.012)


def test_gum_g_3_single_factor_is_student_t():
    # GUM Table G.2: t_95(10) = 2.23, t_95(infinite) = 1.96.
    assert round(single_factor(0.95, 10), 2) == 2.23
    assert round(single_factor(0.95), 2) == 1.96


def test_exact_rectangle_factor_of_two_outputs(gum):
    for rho, exact in gum("coverage_factors")["exact_kq_bivariate_gaussian_p095"].items():
        found = correlated_rectangle_factor(equicorrelated(2, float(rho)))
        assert found.value == pytest.approx(exact, abs=6e-4)


@pytest.mark.all_seeds
def test_exact_rectangle_factor_of_many_outputs_within_its_stated_error(gum):
    misses = []
    for key, exact in gum("coverage_factors")["exact_kq_equicorrelated_gaussian_p095"].items():
        m, rho = (float(part.split("=")[1]) for part in key.split(","))
        found = correlated_rectangle_factor(equicorrelated(int(m), rho))
        assert found.value == pytest.approx(exact, abs=0.01)
        misses.append((found.value - exact) / found.standard_error)
    # With 7 degrees of freedom a standardised miss has a root mean square of 1.18.
    assert 0.6 < math.sqrt(np.mean(np.square(misses))) < 2.0


def test_rectangle_factor_of_perfectly_correlated_outputs_is_that_of_one():
    assert correlated_rectangle_factor(np.ones((5, 5))).value == pytest.approx(single_factor(), abs=1e-9)
    found = correlated_rectangle_factor(np.ones((5, 5)), dof=10)
    assert found.value == pytest.approx(single_factor(dof=10), abs=1e-9)


@pytest.mark.parametrize(("m", "percent"), [(2, 91), (8, 69), (13, 55)])
def test_joint_coverage_of_k_2_each_for_independent_outputs(m, percent):
    covered = joint_coverage(np.eye(m), 2.0)
    assert covered.value == pytest.approx(math.erf(math.sqrt(2.0)) ** m, abs=4e-3)
    assert round(100 * covered.value) == percent


def ellipsoid_factor_of(sample):
    """k_p: the quantile of the distances from the sample's own mean in the metric of its own covariance."""
    return quantile_of(mahalanobis_distances(sample, sample.mean(axis=0), np.cov(sample, rowvar=False)), 0.95)


def test_jcgm102_7_7_sample_factors_of_a_normal_sample():
    rng = np.random.default_rng(1)
    root = rng.standard_normal((4, 4))
    sample = rng.standard_normal((200_000, 4)) @ root.T
    assert ellipsoid_factor_of(sample) == pytest.approx(ellipsoid_factor(4), abs=0.015)
    exact = correlated_rectangle_factor(root @ root.T / np.sqrt(np.outer(*[np.sum(root**2, axis=1)] * 2)))
    deviations = largest_deviations(sample, sample.mean(axis=0), np.cov(sample, rowvar=False))
    assert quantile_of(deviations, 0.95) == pytest.approx(exact.value, abs=0.015)


def test_jcgm102_7_7_sample_factor_of_a_singular_sample_is_that_of_its_rank():
    rng = np.random.default_rng(2)
    plane = rng.standard_normal((100_000, 2))
    sample = plane @ np.array([[1.0, 0.0, 1.0], [0.0, 1e-6, 1.0]])
    assert ellipsoid_factor_of(sample) == pytest.approx(ellipsoid_factor(2), abs=0.02)


def test_refusals_name_argument_and_value():
    with pytest.raises(DataError, match=r"p must lie between 0 and 1, but is 95"):
        ellipsoid_factor(3, 95)
    with pytest.raises(DataError, match=r"number of outputs must be at least 1, but is 0"):
        rectangle_factor(0)
    with pytest.raises(DataError, match=r"degrees of freedom must be positive, but are -1"):
        ellipsoid_factor(2, dof=-1)
    with pytest.raises(DataError, match=r"no form 'exact' of k_q; there are bonferroni and independent"):
        rectangle_factor(2, form="exact")
    with pytest.raises(DataError, match=r"k must be positive, but is 0"):
        joint_coverage(np.eye(2), 0.0)
