"""Monte Carlo of SAMBA: every trial is the least-squares point, whatever the topology; certified and counted."""

from dataclasses import replace

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.uncertainty import (
    BlockSampler,
    MonteCarloOptions,
    adaptive_monte_carlo,
    gum_framework,
    joined,
    measured_run,
    monte_carlo,
    normal_inputs,
    overall,
    pooled_by_day,
    repeated_readings,
    run_estimator,
    uncorrelated,
    validate,
)


def inputs_of(run, spread=1e-3, correlated=0.5, seed=3):
    """Full-rank, correlated readings and an uncorrelated bar, about the run's own readings."""
    rng = np.random.default_rng(seed)
    count = len(run.inputs) - 1
    values = rng.standard_normal((3 * count, count)) + correlated * rng.standard_normal((3 * count, 1))
    values += run.inputs[:-1] / spread - values.mean(axis=0)
    probing = overall(spread * values, run.input_names[:-1], ("mm",) * count, source="probing")
    bar = uncorrelated(run.input_names[-1:], ("mm",), run.inputs[-1:], [1.2e-3], source="scale bar")
    return joined(probing, bar)


@pytest.fixture(scope="module")
def samba(campaign):
    run = measured_run(campaign("five-days"), 1)
    inputs = inputs_of(run)
    return run, inputs, run_estimator(run, inputs)


@pytest.mark.parametrize("topology", ["w C B X b Z Y (C1) t", "w C b X Y Z B (C1) t", "w C A Y b X Z t"])
def test_trials_are_least_squares_points_solved_by_plain_gauss_newton(make_run, topology):
    run = make_run(topology)
    inputs = inputs_of(run)
    estimator = run_estimator(run, inputs)
    drawn = BlockSampler(normal_inputs(inputs), 5, 40).draw(0)
    theta, converged = estimator.unknowns(np.ascontiguousarray(drawn.T))
    plain, solved = run.solve(drawn.T, estimator.sensitivity.unknowns)
    assert np.all(converged)
    assert np.all(solved)
    seen = estimator.sensitivity.determined
    assert np.max(np.abs(theta - plain)[seen] / estimator.u[seen, None]) < 1e-6
    assert estimator.largest_error <= 1e-5
    assert 0.0 < estimator.counts.largest_number < 0.5


def test_samba_has_187_inputs_and_13_parameters(samba):
    run, inputs, estimator = samba
    assert len(inputs.names) == 187
    assert run.unknowns == 34
    assert len(estimator.outputs) == 13
    assert inputs.rank == 187


def test_estimator_is_not_the_fixed_pseudo_inverse(samba):
    run, inputs, estimator = samba
    drawn = np.ascontiguousarray(BlockSampler(normal_inputs(inputs), 6, 200).draw(0).T)
    theta, _ = estimator.unknowns(drawn)
    at = run.repeated(drawn).linearise(np.ascontiguousarray(theta.T), run.common)
    centre = run.repeated(inputs.estimate[:, None])
    fixed = centre.linearise(estimator.sensitivity.unknowns[None], run.common).local[0]
    whole = np.einsum("rnp,rn->rp", at.local, at.residual) @ estimator.sensitivity.inverse
    pseudo = (at.residual @ fixed) @ estimator.sensitivity.inverse
    assert np.max(np.abs(whole) / estimator.u) < 1e-6
    assert np.max(np.abs(pseudo) / estimator.u) > 1e-5


def test_wide_spread_goes_to_gauss_newton_and_is_counted(make_run):
    run = make_run("w C B X b Z Y (C1) t")
    inputs = inputs_of(run, spread=1.0)
    estimator = run_estimator(run, inputs)
    drawn = BlockSampler(normal_inputs(inputs), 7, 30).draw(0)
    theta, converged = estimator.unknowns(np.ascontiguousarray(drawn.T))
    assert estimator.counts.largest_number > 0.5
    assert estimator.by_gauss_newton > 0
    assert estimator.counts.trials == 30
    plain, solved = run.solve(drawn.T, estimator.sensitivity.unknowns)
    both = converged & solved
    assert np.sum(both) > 15
    assert np.max(np.abs(theta - plain)[:, both] / estimator.u[:, None]) < 1e-5


def test_readings_that_contradict_the_machine_do_not_converge(samba):
    run, _, estimator = samba
    wild = np.repeat(run.inputs[:, None], 3, axis=1)
    wild[:-1, 1] = np.random.default_rng(1).uniform(-1e6, 1e6, len(run.inputs) - 1)
    wild[0, 2] = np.nan
    _, converged = estimator.unknowns(wild)
    assert converged[0]
    assert not converged[2]


def test_numbers_are_the_same_for_any_number_of_workers(samba):
    _, inputs, estimator = samba
    sampler = BlockSampler(normal_inputs(inputs), 9, 500)
    units = ("",) * len(estimator.outputs)
    one = monte_carlo(estimator, sampler, estimator.outputs, units, 20_000, MonteCarloOptions(workers=1))
    two = monte_carlo(estimator, sampler, estimator.outputs, units, 20_000, MonteCarloOptions(workers=2))
    assert np.array_equal(one.covariance, two.covariance)
    assert np.array_equal(one.estimate, two.estimate)
    assert (one.k_p, one.k_q) == (two.k_p, two.k_q)


def test_los_2017_chapter_7_framework_is_validated_by_monte_carlo(campaign):
    problem = campaign("five-days")
    run = measured_run(problem, 1)
    days = np.repeat(np.arange(5), 4)
    readings = repeated_readings(problem)
    probing = pooled_by_day(readings, days, run.input_names[:-1], ("mm",) * 186, source="probing")
    bar = uncorrelated(run.input_names[-1:], ("mm",), run.inputs[-1:], [1.2e-3], source="scale bar")
    inputs = joined(probing, bar)
    assert inputs.rank == 16
    estimator = run_estimator(run, inputs)
    at = estimator.sensitivity
    units = ("",) * 13
    framework = gum_framework(
        inputs,
        at.rows(estimator.outputs),
        at.unknowns[at.places(estimator.outputs)],
        estimator.outputs,
        units,
        finite_dof=False,
    )
    assert framework.rank == 13
    sampler = BlockSampler(normal_inputs(inputs), 10, 1000)
    result = adaptive_monte_carlo(
        estimator, sampler, estimator.outputs, units, MonteCarloOptions(digits=1, tighten=5.0, workers=2)
    )
    assert result.stable
    assert result.not_converged == 0
    comparisons = validate(framework, result, digits=1).comparisons
    verdicts = {(one.quantity, one.output): one.verdict for one in comparisons}
    # In chapter 7 all but k_q, which was Bonferroni's there; that of the correlations is validated too.
    assert all(verdict == "validated" for verdict in verdicts.values())
    assert framework.k_q == pytest.approx(result.k_q, abs=4 * result.k_q_error + 0.003)


def test_plans_that_differ_from_run_to_run_have_no_covariance(make_run, campaign):
    problem = campaign("five-days")
    target = problem.context.target.copy()
    rows = np.flatnonzero(problem.context.run == 2)
    target[rows[[0, 1]]] = target[rows[[1, 0]]]
    changed = replace(problem, context=replace(problem.context, target=target))
    with pytest.raises(DataError, match=r"run 2 follows another plan than run 1"):
        repeated_readings(changed)


def test_plan_that_determines_nothing_is_refused(make_run):
    # Without a rotary axis and a known artefact the gains trade against the balls' places.
    run = make_run("w Y b X Z t")
    with pytest.raises(DataError, match=r"the plan determines none of EXX, EYY, EZZ"):
        run_estimator(run, inputs_of(run))


def test_inputs_must_be_those_of_the_run(samba):
    run, inputs, _ = samba
    with pytest.raises(DataError, match=r"readings and distances in order"):
        run_estimator(run, joined(uncorrelated(("a",), ("mm",), [0.0], [1.0], source="a")))
    with pytest.raises(DataError, match=r"no unknown 'nonsense'"):
        run_estimator(run, inputs, ("nonsense",))
