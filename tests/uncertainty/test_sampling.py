"""Marginals, copulas and block streams (JCGM 101:2008 6.4; JCGM 102:2011 clause 5)."""

import math

import numpy as np
import pytest
from scipy import stats

from monitor.exceptions import DataError
from monitor.uncertainty import (
    Arcsine,
    BlockSampler,
    JointDistribution,
    Normal,
    Rectangular,
    StudentT,
    Triangular,
    block_generator,
    independent,
    normal_inputs,
    overall,
)

MARGINALS = [
    (Normal(1.0, 2.0), stats.norm(1.0, 2.0)),
    (StudentT(1.0, 2.0, 5.0), stats.t(5.0, 1.0, 2.0)),
    (Rectangular(-1.0, 3.0), stats.uniform(-1.0, 4.0)),
    (Triangular(-1.0, 3.0), stats.triang(0.5, -1.0, 4.0)),
    (Arcsine(-1.0, 3.0), stats.arcsine(-1.0, 4.0)),
]


@pytest.mark.parametrize(("ours", "scipys"), MARGINALS)
def test_jcgm101_6_4_marginals_agree_with_scipy(ours, scipys):
    probability = np.linspace(1e-6, 1 - 1e-6, 201)
    assert ours.quantile(probability) == pytest.approx(scipys.ppf(probability), rel=1e-9, abs=1e-9)
    assert ours.mean == pytest.approx(scipys.mean())
    assert ours.std == pytest.approx(scipys.std())


@pytest.mark.parametrize("copula", ["gaussian", "t"])
@pytest.mark.parametrize(("marginal", "scipys"), MARGINALS)
def test_copulas_keep_marginals_and_kendalls_tau(copula, marginal, scipys):
    correlation = np.array([[1.0, 0.6], [0.6, 1.0]])
    joint = JointDistribution(("a", "b"), ("mm",) * 2, (marginal, Normal(0.0, 1.0)), correlation, copula, 4.0)
    first, second = joint.draw(np.random.default_rng(3), 20_000)
    assert stats.kstest(first, scipys.cdf).pvalue > 1e-3
    assert stats.kstest(second, "norm").pvalue > 1e-3
    # Of every elliptical copula tau = (2/pi) arcsin(rho).
    assert stats.kendalltau(first, second).statistic == pytest.approx(2 / math.pi * math.asin(0.6), abs=0.02)


def test_t_copula_has_joint_tails_that_the_gaussian_copula_has_not():
    correlation = np.array([[1.0, 0.5], [0.5, 1.0]])
    both = []
    for copula in ("gaussian", "t"):
        marginals = (Rectangular(0.0, 1.0), Rectangular(0.0, 1.0))
        joint = JointDistribution(("a", "b"), ("1", "1"), marginals, correlation, copula, 3.0)
        first, second = joint.draw(np.random.default_rng(4), 1_000_000)
        both.append(np.mean((first > 0.99) & (second > 0.99)) / 0.01)
    # P(both above the 99 % quantile | one is), by quadrature: 0.1294 and 0.3296.
    assert both == pytest.approx([0.1294, 0.3296], abs=0.02)


def test_singular_covariance_is_sampled_in_its_rank():
    values = np.random.default_rng(5).standard_normal((6, 20)) * np.logspace(-3, 3, 20)
    inputs = overall(values, tuple(map(str, range(20))), ("mm",) * 20)
    drawn = BlockSampler(normal_inputs(inputs), 1, 40_000).draw(0)
    scale = np.sqrt(np.outer(np.diag(inputs.covariance), np.diag(inputs.covariance)))
    assert np.max(np.abs((np.cov(drawn, rowvar=False) - inputs.covariance) / scale)) < 0.04
    # Nothing is added outside the rank: every draw is a combination of the five deviations.
    centred = (drawn - inputs.estimate) / inputs.u
    basis = np.linalg.svd((values - values.mean(axis=0)) / inputs.u)[2][:5]
    assert np.max(np.abs(centred - centred @ basis.T @ basis)) < 1e-11


def test_streams_are_those_of_spawned_seed_sequences():
    child = np.random.SeedSequence(42).spawn(4)[3]
    expected = np.random.Generator(np.random.SFC64(child)).standard_normal(5)
    assert np.array_equal(block_generator(42, 3).standard_normal(5), expected)
    sampler = BlockSampler((independent(("a",), ("mm",), (Normal(0.0, 1.0),)),), 42, 10)
    assert np.array_equal(sampler.draw(3), sampler.draw(3))
    assert not np.array_equal(sampler.draw(3), sampler.draw(2))


def test_sampling_refusals():
    with pytest.raises(DataError, match=r"no copula 'clayton'; there are gaussian and t"):
        JointDistribution(("a",), ("mm",), (Normal(0.0, 1.0),), np.eye(1), "clayton")
    with pytest.raises(DataError, match=r"finite copula_dof, but has inf"):
        JointDistribution(("a",), ("mm",), (Normal(0.0, 1.0),), np.eye(1), "t")
    with pytest.raises(DataError, match=r"finite low < high, but has low 1.0, high 1.0"):
        Rectangular(1.0, 1.0)
    with pytest.raises(DataError, match=r"every input of a sampler needs its own name"):
        BlockSampler((independent(("a",), ("mm",), (Normal(0.0, 1.0),)),) * 2, 1)
