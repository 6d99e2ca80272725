"""The worked examples of JCGM 102:2011 clause 9 by Monte Carlo, framework and validation."""

import math

import numpy as np
import pytest

from monitor.uncertainty import (
    BlockSampler,
    Inputs,
    JointDistribution,
    MonteCarloOptions,
    Normal,
    Rectangular,
    adaptive_monte_carlo,
    gum_framework,
    independent,
    monte_carlo,
    normal_inputs,
    overall,
    validate,
)
from monitor.uncertainty.coverage_regions.coverage import mahalanobis_distances, quantile_of

ADD = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 1.0]])


def additive(block):
    return block @ ADD.T, np.ones(len(block), dtype=bool)


def additive_run(marginals, seed=3, trials=400_000):
    joint = independent(("X1", "X2", "X3"), ("1",) * 3, marginals)
    sampler = BlockSampler((joint,), seed, 10_000)
    return monte_carlo(additive, sampler, ("Y1", "Y2"), ("1", "1"), trials, MonteCarloOptions(keep=trials))


@pytest.mark.parametrize(
    ("key", "halves", "k_q", "k_p"),
    [
        ("case_1_gaussian", None, "k_q_exact_rho_0_5", "k_p"),
        ("rectangular_same_moments", (1.0, 1.0, 1.0), "k_q_exact", "k_p_numeric"),
        ("rectangular_large_common", (1.0, 1.0, 3.0), "k_q_exact", "k_p_numeric"),
    ],
)
def test_jcgm102_9_2_additive_model(gum, key, halves, k_q, k_p):
    case = gum("gum_S2_9_2_additive")[key]
    marginals = [Normal(0.0, 1.0)] * 3
    if halves is not None:
        marginals = [Rectangular(-h * math.sqrt(3), h * math.sqrt(3)) for h in halves]
    result = additive_run(marginals)
    u = np.broadcast_to(case["u"], 2)
    assert result.estimate == pytest.approx([0.0, 0.0], abs=0.006 * u[0])
    assert result.u == pytest.approx(u, rel=0.005)
    assert result.correlation[0, 1] == pytest.approx(case["r"], abs=0.006)
    assert result.lambda_max == pytest.approx(1 + case["r"], abs=0.006)
    assert abs(result.k_p - case[k_p]) < max(4 * result.k_p_error, 0.002)
    assert abs(result.k_q - case[k_q]) < max(4 * result.k_q_error, 0.002)


def test_jcgm102_9_2_framework_is_validated_for_normal_inputs():
    inputs = Inputs(("X1", "X2", "X3"), ("1",) * 3, np.zeros(3), np.eye(3), ("X1", "X2", "X3"))
    framework = gum_framework(inputs, ADD, np.zeros(2), ("Y1", "Y2"), ("1", "1"))
    result = adaptive_monte_carlo(
        additive,
        BlockSampler(normal_inputs(inputs), 8, 10_000),
        ("Y1", "Y2"),
        ("1", "1"),
        MonteCarloOptions(tighten=5.0, keep=2_000_000),
    )
    assert result.stable
    validation = validate(framework, result)
    assert validation.verdict == "validated"
    assert len(validation.comparisons) == 2 + 2 + 3
    # At three digits too, where the correlation shows: k_q is 2.212, and Bonferroni's bound 2.241.
    strict = {one.quantity: one for one in validate(framework, result, digits=3).comparisons}
    assert strict["k_q"].difference <= strict["k_q"].tolerance
    assert framework.k_q == pytest.approx(2.212, abs=0.003)


def test_jcgm102_9_2_framework_is_not_validated_for_rectangular_inputs():
    inputs = Inputs(("X1", "X2", "X3"), ("1",) * 3, np.zeros(3), np.diag([1.0, 1.0, 9.0]), ("X1", "X2", "X3"))
    framework = gum_framework(inputs, ADD, np.zeros(2), ("Y1", "Y2"), ("1", "1"))
    result = additive_run([Rectangular(-h * math.sqrt(3), h * math.sqrt(3)) for h in (1.0, 1.0, 3.0)])
    validation = validate(framework, result)
    assert not validation.passed
    assert {one.quantity for one in validation.failed()} >= {"k_p", "k_q"}


def polar(block):
    real, imaginary = block.T
    outputs = np.column_stack([np.hypot(real, imaginary), np.arctan2(imaginary, real)])
    return outputs, np.ones(len(block), dtype=bool)


def test_jcgm102_9_3_cartesian_to_polar(gum):
    cases = gum("gum_S2_9_3_cartesian_polar")["cases"]
    assert len(cases) == 6
    for case in cases:
        correlation = np.array([[1.0, case["r_in"]], [case["r_in"], 1.0]])
        marginals = (Normal(case["x_re"], case["u"]), Normal(case["x_im"], case["u"]))
        joint = JointDistribution(("re", "im"), ("1", "1"), marginals, correlation)
        result = monte_carlo(
            polar, BlockSampler((joint,), 4, 10_000), ("magnitude", "phase"), ("1", "rad"), 500_000
        )
        exact = case["exact"]
        assert result.estimate[0] == pytest.approx(exact["E_mag"], abs=6e-5)
        assert result.estimate[1] == pytest.approx(exact["E_phase"], abs=0.01)
        assert result.u[0] == pytest.approx(exact["u_mag"], rel=0.008)
        assert result.u[1] == pytest.approx(exact["u_phase"], rel=0.008)
        assert result.correlation[0, 1] == pytest.approx(exact["r"], abs=0.008)
        published = case["published_JCGM102_table_6_7"]
        if published is not None:
            assert round(result.u[0], 3) == pytest.approx(published["MCM"]["u_mag"], abs=1e-9)
            assert result.u[1] == pytest.approx(published["MCM"]["u_ph"], abs=0.006)


def test_jcgm102_9_3_framework_fails_validation_near_the_origin():
    inputs = Inputs(("re", "im"), ("1", "1"), np.array([0.001, 0.0]), 1e-4 * np.eye(2), ("re", "im"))
    sensitivity = np.array([[1.0, 0.0], [0.0, 1000.0]])
    framework = gum_framework(inputs, sensitivity, np.array([0.001, 0.0]), ("mag", "phase"), ("1", "rad"))
    sampler = BlockSampler(normal_inputs(inputs), 5, 10_000)
    result = monte_carlo(polar, sampler, ("mag", "phase"), ("1", "rad"), 200_000)
    validation = validate(framework, result)
    assert validation.verdict == "not validated"
    by_name = {(one.quantity, one.output): one for one in validation.comparisons}
    assert by_name["u", "phase"].framework == pytest.approx(10.0)
    assert by_name["u", "phase"].monte_carlo == pytest.approx(1.744, abs=0.01)


def test_jcgm102_9_4_resistance_and_reactance_have_rank_2(references):
    data = np.loadtxt(references / "gum" / "gum_H2_data.csv", delimiter=",", skiprows=1)
    data[:, 1] *= 1e-3
    inputs = overall(data, ("V", "I", "phi"), ("V", "A", "rad"), mean_of=5)

    def impedance(block):
        voltage, current, phase = block.T
        z = voltage / current
        outputs = np.column_stack([z * np.cos(phase), z * np.sin(phase), z])
        return outputs, np.ones(len(block), dtype=bool)

    # Curvature leaves 1e-7 of a variance in the third direction: below the tolerance it takes no part.
    result = monte_carlo(
        impedance,
        BlockSampler(normal_inputs(inputs), 6, 10_000),
        ("R", "X", "Z"),
        ("ohm",) * 3,
        200_000,
        MonteCarloOptions(rank_tolerance=1e-5),
    )
    assert result.rank == 2
    assert result.k_p == pytest.approx(math.sqrt(-2 * math.log(0.05)), abs=4 * result.k_p_error)
    assert result.u == pytest.approx([0.0711, 0.2956, 0.2363], rel=0.01)
    sample = np.asarray(result.sample)
    own = mahalanobis_distances(sample, sample.mean(axis=0), np.cov(sample, rowvar=False))
    assert quantile_of(own, 0.95) > result.k_p
