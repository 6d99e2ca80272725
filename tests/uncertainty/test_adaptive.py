"""The adaptive procedure of JCGM 102:2011 7.8, step by step, and what it does with trials that fail."""

import math

import numpy as np
import pytest
from scipy.special import erfinv

from monitor.exceptions import DataError, RefusedResultError
from monitor.progress import listening
from monitor.uncertainty import (
    BlockSampler,
    Inputs,
    MonteCarloOptions,
    Normal,
    adaptive_monte_carlo,
    ellipsoid_factor,
    gum_framework,
    independent,
    monte_carlo,
    numerical_tolerance,
    validate,
)
from monitor.uncertainty.coverage_regions.coverage import quantile_standard_error
from monitor.uncertainty.monte_carlo.adaptive import sequence_length
from monitor.uncertainty.monte_carlo.moments import Moments

NAMES, UNITS = ("Y1", "Y2", "Y3"), ("mm", "mm", "rad")
MIX = np.array([[1.0, 0.5, 0.0, 0.0], [0.0, 1.0, -0.3, 0.2], [1e-6, 0.0, 0.0, 2e-6]])


def sampler(seed=1, block_size=1000):
    return BlockSampler((independent("abcd", ("mm",) * 4, [Normal(0.0, 1.0)] * 4),), seed, block_size)


def linear(block):
    return block @ MIX.T, np.ones(len(block), dtype=bool)


def test_jcgm102_7_8_3_length_of_a_sequence(gum):
    values = gum("jcgm102_adaptive_procedure")["p095_values"]
    assert math.ceil(100 / 0.05) == values["J"]
    assert sequence_length(0.95, 1000) == values["M"]
    assert sequence_length(0.999, 1000) == 100_000
    assert sequence_length(0.95, 4096) == 12_288


def test_jcgm102_7_8_3_starts_with_ten_sequences_and_stops_when_stable(gum):
    result = adaptive_monte_carlo(linear, sampler(), NAMES, UNITS, MonteCarloOptions(digits=1))
    assert result.trials == gum("jcgm102_adaptive_procedure")["p095_values"]["initial_total"]
    assert result.sequences == 10
    assert result.stable


def test_jcgm102_7_8_3_goes_on_until_twice_every_standard_error_is_below_its_tolerance():
    result = adaptive_monte_carlo(linear, sampler(), NAMES, UNITS, MonteCarloOptions(digits=3))
    assert result.sequences > 10
    allowed = [numerical_tolerance(u, 3) for u in result.u]
    assert np.all(2 * result.standard_errors.estimate <= allowed)
    assert np.all(2 * result.standard_errors.u <= allowed)
    assert 2 * result.standard_errors.lambda_max <= numerical_tolerance(result.lambda_max, 3)
    assert 2 * result.standard_errors.k_p <= numerical_tolerance(result.k_p, 3)
    assert 2 * result.standard_errors.k_q <= numerical_tolerance(result.k_q, 3)


def test_standard_errors_are_those_of_the_sequences_one_by_one():
    result = monte_carlo(linear, sampler(block_size=10_000), NAMES, UNITS, 120_000)
    blocks = [linear(sampler(block_size=10_000).draw(i))[0] for i in range(12)]
    means = [block.mean(axis=0) for block in blocks]
    scatters = [block.std(axis=0, ddof=1) for block in blocks]
    assert result.standard_errors.estimate == pytest.approx(np.std(means, axis=0, ddof=1) / math.sqrt(12))
    assert result.standard_errors.u == pytest.approx(np.std(scatters, axis=0, ddof=1) / math.sqrt(12))
    every = np.concatenate(blocks)
    assert result.estimate == pytest.approx(every.mean(axis=0), abs=1e-12)
    assert result.covariance == pytest.approx(np.cov(every, rowvar=False), rel=1e-10, abs=1e-20)
    assert np.array_equal(result.sample, every)


@pytest.mark.parametrize(("digits", "max_trials"), [(1, 10_000_000), (3, 10_000_000), (5, 150_000)])
def test_the_share_told_while_it_runs_is_that_of_the_trials_and_moves_no_number(digits, max_trials):
    options = MonteCarloOptions(digits=digits, max_trials=max_trials)
    alone = adaptive_monte_carlo(linear, sampler(), NAMES, UNITS, options)
    shares = []
    with listening(shares.append):
        result = adaptive_monte_carlo(linear, sampler(), NAMES, UNITS, options)
    assert np.array_equal(result.sample, alone.sample)
    assert np.array_equal(result.covariance, alone.covariance)
    assert len(shares) == result.sequences - 1
    assert all(0.0 <= share <= 1.0 for share in shares)
    # What is left is foretold from the scatter of the sequences: from the second half on within a factor of two.
    true = np.arange(1, result.sequences) / result.sequences
    later = true > 0.5
    assert np.all(np.array(shares)[later] > true[later] / 2.0)
    assert np.all(np.array(shares)[later] < 2.0 * true[later])
    nobody_listens = len(shares)
    adaptive_monte_carlo(linear, sampler(), NAMES, UNITS, MonteCarloOptions(digits=1))
    assert len(shares) == nobody_listens


def test_tolerances_that_cannot_be_reached_end_at_max_trials_and_say_so():
    result = adaptive_monte_carlo(
        linear, sampler(), NAMES, UNITS, MonteCarloOptions(digits=5, max_trials=150_000)
    )
    assert result.trials == 150_000
    assert not result.stable


def test_closed_form_linear_case():
    inputs = Inputs(tuple("abcd"), ("mm",) * 4, np.zeros(4), np.eye(4), tuple("abcd"))
    framework = gum_framework(inputs, MIX, np.zeros(3), NAMES, UNITS)
    result = adaptive_monte_carlo(
        linear, sampler(2), NAMES, UNITS, MonteCarloOptions(tighten=5.0, keep=1_000_000)
    )
    assert result.u == pytest.approx(np.sqrt(np.diag(MIX @ MIX.T)), rel=3e-3)
    assert result.k_p == pytest.approx(ellipsoid_factor(3), abs=4 * result.k_p_error)
    validation = validate(framework, result)
    assert validation.passed
    assert validation.trials == result.trials


def test_standard_errors_are_honest_over_many_seeds():
    truth = np.concatenate([np.zeros(3), np.sqrt(np.diag(MIX @ MIX.T))])
    pulls = []
    for seed in range(60):
        result = monte_carlo(
            linear, sampler(seed, 10_000), NAMES, UNITS, 100_000, MonteCarloOptions(keep=1000)
        )
        found = np.concatenate([result.estimate, result.u])
        errors = np.concatenate([result.standard_errors.estimate, result.standard_errors.u])
        pulls.append((found - truth) / errors)
    # Student's t with 9 degrees of freedom has a standard deviation of 1.13; 360 pulls.
    assert 1.0 < np.std(pulls) < 1.28
    assert abs(np.mean(pulls)) < 0.25


def test_numbers_do_not_depend_on_the_number_of_workers():
    one = monte_carlo(linear, sampler(), NAMES, UNITS, 50_000, MonteCarloOptions(workers=1))
    three = monte_carlo(linear, sampler(), NAMES, UNITS, 50_000, MonteCarloOptions(workers=3))
    assert np.array_equal(one.covariance, three.covariance)
    assert np.array_equal(one.sample, three.sample)
    assert (one.k_p, one.k_q) == (three.k_p, three.k_q)


def test_sample_is_bounded_and_moments_are_not():
    result = monte_carlo(linear, sampler(), NAMES, UNITS, 60_000, MonteCarloOptions(keep=7000))
    assert result.sample.shape == (7000, 3)
    every = np.concatenate([linear(sampler().draw(i))[0] for i in range(60)])
    assert result.u == pytest.approx(every.std(axis=0, ddof=1), rel=1e-12)
    assert result.k_p_error > 2 * monte_carlo(linear, sampler(), NAMES, UNITS, 60_000).k_p_error


def test_quantile_error_is_that_of_order_statistics():
    rng = np.random.default_rng(9)
    found = [np.partition(rng.standard_normal(4000), 3799)[3799] for _ in range(400)]
    stated = np.mean([quantile_standard_error(rng.standard_normal(4000), 0.95) for _ in range(50)])
    assert stated == pytest.approx(np.std(found), rel=0.15)


def test_merged_moments_equal_those_of_all_values_far_from_zero():
    values = 1e6 + np.random.default_rng(3).standard_normal((1000, 4))
    merged = Moments.of(values[:1])
    for part in (values[1:400], values[400:400], values[400:]):
        merged = merged.merged(Moments.of(part))
    assert merged.count == 1000
    assert merged.covariance == pytest.approx(np.cov(values, rowvar=False), rel=1e-8, abs=1e-9)


def failing(part):
    """A model in which the outermost ``part`` of the first input does not converge."""

    def model(block):
        outputs, good = linear(block)
        limit = math.sqrt(2) * erfinv(1 - part)
        return outputs, good & (np.abs(block[:, 0]) < limit)

    return model


def test_trials_that_do_not_converge_are_counted():
    result = monte_carlo(failing(2e-4), sampler(), NAMES, UNITS, 200_000)
    assert 20 <= result.not_converged <= 60
    assert result.trials == 200_000
    assert np.all(np.isfinite(result.covariance))


def test_outputs_that_are_not_finite_count_as_not_converged():
    def model(block):
        outputs, good = linear(block)
        outputs[:1, 0] = np.nan
        return outputs, good

    result = monte_carlo(model, sampler(block_size=10_000), NAMES, UNITS, 100_000)
    assert result.not_converged == 10


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (0.01, r"of 200000 trials did not converge, and it matters: k_p could be"),
        (0.2, r"only 79\.\d+ % of the trials gave outputs, less than p"),
        (1.0, r"10000 of the first 10000 trials did not converge"),
    ],
)
def test_result_refuses_itself_when_it_matters(part, message):
    with pytest.raises(RefusedResultError, match=message):
        monte_carlo(failing(part), sampler(), NAMES, UNITS, 200_000)


def test_model_of_the_wrong_shape_is_named():
    with pytest.raises(DataError, match=r"must return outputs \(1000, 2\).*but returned \(1000, 3\)"):
        monte_carlo(linear, sampler(), NAMES[:2], UNITS[:2], 10_000)
    with pytest.raises(DataError, match=r"keep at least 1000, but are 2, 10, 1.0 and 10"):
        adaptive_monte_carlo(linear, sampler(), NAMES, UNITS, MonteCarloOptions(keep=10))
    with pytest.raises(DataError, match=r"workers must be at least 1, but is 0"):
        monte_carlo(linear, sampler(), NAMES, UNITS, 10_000, MonteCarloOptions(workers=0))


def test_validation_needs_the_same_outputs():
    inputs = Inputs(tuple("abcd"), ("mm",) * 4, np.zeros(4), np.eye(4), tuple("abcd"))
    framework = gum_framework(inputs, MIX, np.zeros(3), ("A", "B", "C"), UNITS)
    result = monte_carlo(linear, sampler(), NAMES, UNITS, 20_000)
    with pytest.raises(DataError, match=r"one has A, B, C and the other Y1, Y2, Y3"):
        validate(framework, result)


def test_validation_is_undecided_where_too_few_trials_leave_the_answer_open():
    inputs = Inputs(tuple("abcd"), ("mm",) * 4, np.zeros(4), np.eye(4), tuple("abcd"))
    framework = gum_framework(inputs, MIX, np.zeros(3), NAMES, UNITS)
    result = monte_carlo(linear, sampler(), NAMES, UNITS, 20_000)
    validation = validate(framework, result, digits=3)
    assert validation.verdict == "undecided"
    assert not validation.passed
