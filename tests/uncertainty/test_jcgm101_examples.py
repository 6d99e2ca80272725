"""The worked examples of JCGM 101:2008 clause 9."""

import numpy as np
import pytest

from monitor.uncertainty import (
    Arcsine,
    BlockSampler,
    JointDistribution,
    MonteCarloOptions,
    Normal,
    Rectangular,
    StudentT,
    independent,
    monte_carlo,
)

ROOT3 = np.sqrt(3.0)


def coverage_interval(values, p=0.95, form="symmetric"):
    """The interval that holds a part p of the values: (1 - p)/2 on either side (7.7.2), or the shortest (7.7.4)."""
    ordered = np.sort(values.ravel())
    inside = int(p * len(ordered) + 0.5)
    if form == "symmetric":
        low = int((len(ordered) - inside) / 2 + 0.5) - 1
    else:
        low = int(np.argmin(ordered[inside:] - ordered[:-inside]))
    return float(ordered[low]), float(ordered[low + inside])


def run(marginals, function, trials=500_000, correlation=None, seed=7, p=0.95):
    names = tuple(f"X{i + 1}" for i in range(len(marginals)))
    matrix = np.eye(len(names)) if correlation is None else correlation
    joint = JointDistribution(names, ("1",) * len(names), tuple(marginals), matrix)

    def model(block):
        return function(block)[:, None], np.ones(len(block), dtype=bool)

    sampler = BlockSampler((joint,), seed, 10_000)
    return monte_carlo(model, sampler, ("Y",), ("1",), trials, MonteCarloOptions(p=p, keep=trials))


def total(block):
    return block.sum(axis=1)


@pytest.mark.parametrize(
    ("clause", "marginals", "exact_u", "exact_half"),
    [
        ("s9_2_2", [Normal(0.0, 1.0)] * 4, 2.0, "exact_ci95"),
        ("s9_2_3", [Rectangular(-ROOT3, ROOT3)] * 4, 2.0, "exact_ci95"),
    ],
)
def test_jcgm101_9_2_additive_model(gum, clause, marginals, exact_u, exact_half):
    case = gum("gum_S1_examples")[clause]
    result = run(marginals, total)
    low, high = coverage_interval(result.sample, 0.95)
    assert result.estimate[0] == pytest.approx(0.0, abs=0.012)
    assert result.u[0] == pytest.approx(exact_u, abs=0.009)
    assert (low, high) == pytest.approx((-case[exact_half], case[exact_half]), abs=0.03)
    assert (low, high) == pytest.approx(tuple(case["published"]["ci95"]), abs=0.035)


def test_jcgm101_9_2_4_dominant_rectangular_input(gum):
    case = gum("gum_S1_examples")["s9_2_4"]["exact"]
    result = run([Rectangular(-ROOT3, ROOT3)] * 3 + [Rectangular(-10 * ROOT3, 10 * ROOT3)], total)
    assert result.u[0] == pytest.approx(case["u"], abs=0.04)
    assert coverage_interval(result.sample)[1] == pytest.approx(case["ci95"], abs=0.06)
    # Here the framework's interval is a sixth too wide.
    assert case["GUF_ci95"] / coverage_interval(result.sample)[1] > 1.15


def test_jcgm101_9_3_mass_calibration(gum):
    case = gum("gum_S1_examples")["s9_3"]["mc_1e7"]

    def mass(x):
        reference, deviation, air, weight, standard = x.T
        return (reference + deviation) * (1 + (air - 1.2) * (1 / weight - 1 / standard)) - 1e5

    marginals = [
        Normal(1e5, 0.050),
        Normal(1.234, 0.020),
        Rectangular(1.10, 1.30),
        Rectangular(7000.0, 9000.0),
        Rectangular(7950.0, 8050.0),
    ]
    result = run(marginals, mass)
    assert result.estimate[0] == pytest.approx(case["y"], abs=5e-4)
    assert result.u[0] == pytest.approx(case["u"], abs=4e-4)
    assert coverage_interval(result.sample, form="shortest") == pytest.approx(case["shortest95"], abs=6e-3)


def test_jcgm101_9_4_comparison_loss_in_microwave_power_meter(gum):
    for case in gum("gum_S1_examples")["s9_4"]["cases"]:
        correlation = np.array([[1.0, case["r"]], [case["r"], 1.0]])
        marginals = [Normal(case["x1"], case["u"]), Normal(case["x2"], case["u"])]
        result = run(marginals, lambda x: 1e6 * (x[:, 0] ** 2 + x[:, 1] ** 2), correlation=correlation)
        scale = case["exact_u_1e6"]
        assert result.estimate[0] == pytest.approx(case["exact_mean_1e6"], abs=0.006 * scale)
        assert result.u[0] == pytest.approx(scale, rel=0.008)
        shortest = coverage_interval(result.sample, form="shortest")
        assert shortest == pytest.approx(case["mc_shortest95_1e6"], abs=0.06 * scale)


class Empirical:
    """A recorded sample as a marginal: its quantiles, linear between the ordered values (JCGM 101 6.5)."""

    def __init__(self, values):
        self.values = np.sort(values)
        self.mean, self.std = float(np.mean(self.values)), float(np.std(self.values))

    def quantile(self, probability):
        rank = probability * (len(self.values) - 1)
        return np.interp(rank, np.arange(len(self.values)), self.values)


def curved_trapezoid(low, high, inexactness, size=400_001):
    """JCGM 101 6.4.3 as a sampled marginal: limits that are themselves uncertain by ± ``inexactness``."""
    rng = np.random.default_rng(0)
    first = low - inexactness + 2 * inexactness * rng.random(size)
    return Empirical(first + ((low + high) - 2 * first) * rng.random(size))


def test_jcgm101_9_5_gauge_block(gum):
    case = gum("gum_S1_examples")["s9_5"]["mc_1e7"]

    def length(x):
        standard, deviation, d1, d2, alpha, theta, cyclic, d_alpha, d_theta = x.T
        warm = d_alpha * (theta + cyclic) + alpha * d_theta
        return standard + deviation + d1 + d2 - standard * warm - 50_000_000.0

    marginals = [
        StudentT(50_000_623.0, 25.0, 18.0),
        StudentT(215.0, 6.0, 24.0),
        StudentT(0.0, 4.0, 5.0),
        StudentT(0.0, 7.0, 8.0),
        Rectangular(9.5e-6, 13.5e-6),
        Normal(-0.1, 0.2),
        Arcsine(-0.5, 0.5),
        curved_trapezoid(-1e-6, 1e-6, 0.1e-6),
        curved_trapezoid(-0.050, 0.050, 0.025),
    ]
    result = run(marginals, length, p=0.99)
    assert result.estimate[0] == pytest.approx(case["mean"], abs=0.3)
    assert result.u[0] == pytest.approx(case["u"], abs=0.25)
    assert coverage_interval(result.sample, 0.99) == pytest.approx(case["ci99_sym"], abs=1.5)
    # To the printed digits: 838 nm, 36 nm, 745 nm to 932 nm.
    assert round(result.estimate[0]) == 838
    assert round(result.u[0]) == 36


def test_independent_is_the_identity_correlation():
    joint = independent(("a", "b"), ("1", "1"), (Normal(0.0, 1.0), Normal(0.0, 1.0)))
    assert np.array_equal(joint.correlation, np.eye(2))
