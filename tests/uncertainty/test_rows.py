"""The uncertainty of any method: inputs are what the rows tell, trials are expanded to second order and checked."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from by_path import load

from monitor.exceptions import DataError
from monitor.methods.rotary_probing.method import METHOD as rotary_probing
from monitor.uncertainty import (
    RowRun,
    gum_framework,
    measured_run,
    repeated_readings,
    run_estimator,
    sensitivity_of,
    uncorrelated,
)
from monitor.uncertainty.runs.expansion import expansion_of

TESTS = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def problem(simulator):
    """Three runs of a small plan on faces and a sphere, with 1 µm of noise, on a machine with large errors."""
    rp = importlib.import_module("simulator.rotary_probing")
    campaigns = load("rotary_campaigns", TESTS / "methods" / "rotary_campaigns.py")
    rng = np.random.default_rng(5)
    features = [*rp.block(along=(-30.0, 30.0)), *rp.sphere("K1", (80.0, -120.0, 90.0))]
    plan = rp.every_pose(features, [{"A": a, "C": c} for a in (0.0, -90.0) for c in (0.0, 120.0, 240.0)])
    large = {name: 20.0 * value for name, value in campaigns.TRUTH.items()}
    chain = sys.modules["simulator.chain"].read_topology(campaigns.PAPER)
    runs = [rp.touch(chain, plan, campaigns.location(large), rng, noise_mm=1e-3) for _ in range(3)]
    return rotary_probing.problem_of(campaigns.touched(campaigns.PAPER, plan, runs, sigma=1e-3))


@pytest.fixture(scope="module")
def one(problem) -> RowRun:
    found = measured_run(problem, 2)
    assert isinstance(found, RowRun)
    return found


def inputs_of(one: RowRun):
    u = np.concatenate([one.stated, one.calibrated[2]])
    return uncorrelated(one.input_names, ("mm",) * len(u), one.inputs, u, source="readings")


def test_inputs_are_named_after_rows(one):
    assert one.input_names[0] == "normal 1"
    assert len(one.input_names) == one.probings


def test_expansion_is_the_exact_gradient(one):
    at = sensitivity_of(one)
    rng = np.random.default_rng(1)
    theta = at.unknowns[:, None] + 10.0 * at.steps[:, None] * rng.standard_normal((one.unknowns, 5))
    inputs = 5e-3 * rng.standard_normal((one.probings, 5))
    exact = one.gradient(theta, inputs)
    quick = expansion_of(one, at.unknowns, at.steps).gradient(theta, inputs)
    np.testing.assert_allclose(quick, exact, atol=1e-7 * np.abs(exact).max(axis=1, keepdims=True).max())
    assert at.gradient.__self__.__class__.__name__ == "Expansion"


def test_points_share_the_differences_of_the_expansion(one):
    at = sensitivity_of(one)
    groups = expansion_of(one, at.unknowns, at.steps).groups
    # Eight location errors act on every row, and a row has one height or four unknowns of a sphere.
    assert max(len(group.at) for group in groups) == 12
    assert sorted(row for group in groups for row in group.rows) == list(range(one.probings))


def test_sensitivity_is_what_solving_again_gives(one):
    at = sensitivity_of(one)
    moved = np.zeros((one.probings, 2))
    moved[7] = (1e-3, -1e-3)
    solved, converged = one.solve(moved, at.unknowns)
    assert converged.all()
    # Relative to the largest: what a row hardly moves is lost in the digits of the difference.
    slope = (solved[:, 0] - solved[:, 1]) / 2e-3
    np.testing.assert_allclose(at.matrix[:, 7], slope, atol=1e-6 * np.abs(slope).max())


def test_every_trial_is_the_full_identification(one):
    estimator = run_estimator(one, inputs_of(one))
    trials = 5e-3 * np.random.default_rng(2).standard_normal((40, one.probings))
    found, converged = estimator(trials)
    exact, solved = one.solve(trials.T, estimator.sensitivity.unknowns)
    assert converged.all()
    assert solved.all()
    count = len(one.problem.base_names)
    assert np.abs(found - exact[:count].T).max() < 1e-5 * estimator.u[:count].min()


def test_framework_and_trials_agree(one):
    inputs = inputs_of(one)
    at = sensitivity_of(one)
    names = one.problem.base_names
    guf = gum_framework(inputs, at.rows(names), at.unknowns[at.places(names)], names, ["mm"] * len(names))
    estimator = run_estimator(one, inputs)
    trials = 1e-3 * np.random.default_rng(3).standard_normal((4000, one.probings))
    found, _ = estimator(trials)
    # 4000 trials give a standard deviation to 1.1 %.
    np.testing.assert_allclose(found.std(axis=0, ddof=1), guf.u, rtol=0.05)


def test_rows_of_repeated_runs_differ_by_their_noise(problem):
    rows = repeated_readings(problem)
    assert rows.shape == (3, np.sum(problem.context.run == 1))
    # Each point's own mean is taken as its reference: six touches of it leave 5/6 of the variance.
    assert 0.8e-3 < np.sqrt(np.mean(rows.var(axis=0, ddof=1))) < 1.1e-3


def test_another_plan_is_refused(problem):
    context = problem.context
    target = context.target.copy()
    rows = np.flatnonzero(context.run == 3)
    target[rows[0]] = target[rows[1]]
    with pytest.raises(DataError, match="run 3 follows another plan than run 1"):
        repeated_readings(replace(problem, context=replace(context, target=target)))


def test_a_row_without_weight_counts_for_nothing(problem):
    sigma = problem.sigma.copy()
    sigma[3] = np.inf
    one = measured_run(replace(problem, sigma=sigma), 1)
    at = sensitivity_of(one)
    assert np.all(at.matrix[:, 3] == 0.0)
    assert one.stated[3] == 0.0


def test_an_unknown_run_is_refused(problem):
    with pytest.raises(DataError, match="no run 9; there are runs 1, 2, 3"):
        measured_run(problem, 9)
