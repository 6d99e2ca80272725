"""Shapes that the catalogue does not have: the right error alone, and a model to which it is added is complete.

All families are in tests/benchmarks/trial_unknown.py; here three of them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from by_path import load, simulator

from monitor.discovery import explain, fit
from monitor.discovery.machine.fit import fit_those_possible
from monitor.discovery.machine.held_out import held_out_by_poses, pose_folds
from monitor.effects import parse_effect
from monitor.effects.shapes.free import way_since_reversal
from monitor.exceptions import DataError
from monitor.methods.model import Model
from monitor.methods.samba.method import problem_of


@pytest.fixture(scope="module")
def trial():
    return load("trial_unknown", Path(__file__).resolve().parents[1] / "benchmarks" / "trial_unknown.py")


@pytest.mark.parametrize("family", ["play over 40 mm", "fifth harmonic of C", "X times B"])
def test_the_right_error_alone_is_named(virtual_campaigns, trial, explained, family):
    right, effect, curve = trial.FAMILIES[family]
    hidden = simulator().Effect(effect, peak_um=5.0, curve=curve)
    campaign, _ = virtual_campaigns.virtual(4, [hidden], days=2)
    (found,) = explained(campaign).missing
    assert found.effect.partition(":")[0] in right
    assert found.nearest is not None
    assert found.held_out_after == pytest.approx(1e-3, rel=0.05)
    assert found.held_out_poses_after < found.held_out_poses_before
    assert len(found.curve.at) > 10
    grown = problem_of(campaign, Model("grown", added=(found.effect,)))
    assert explain(campaign, grown, "grown", rng=np.random.default_rng(1)).missing == ()


def test_the_way_since_a_reversal_is_that_of_the_simulator(virtual_campaigns, trial):
    campaign, told = virtual_campaigns.virtual(1, days=1, runs_per_day=2, noise_um=0.0)
    context = problem_of(campaign).context
    joint = next(index for index, part in enumerate(context.chain.joints) if part.name == "X")

    class Now:
        run = told["run"]

    expected = trial.since_reversal(told["readings"]["X"], told["travel"]["X"], Now)
    np.testing.assert_allclose(way_since_reversal(context, joint), expected, atol=1e-9)


def test_held_out_poses_agree_with_fits_without_them(virtual_campaigns):
    """Every fold is left out in turn and the rest fitted by numpy's lstsq, the runs' own unknowns included."""
    campaign, _ = virtual_campaigns.virtual(2, days=1, runs_per_day=2)
    fitted = fit(problem_of(campaign))
    residual, basis = fitted.white, fitted.nuisance.basis
    runs, rows, own = basis.shape
    columns = np.random.default_rng(1).standard_normal((runs, rows, 2))
    columns -= basis @ (np.swapaxes(basis, 1, 2) @ columns)
    whole = np.zeros((runs, rows, runs * own + 2))
    for run in range(runs):
        whole[run, :, run * own : (run + 1) * own] = basis[run]
    whole[:, :, -2:] = columns
    folds = pose_folds(fitted)
    squares, count = 0.0, 0
    for fold in folds:
        out = np.zeros((runs, rows), dtype=bool)
        for run in range(runs):
            out[run, fold.rows[run]] = True
        values = np.linalg.eigvalsh(np.eye(len(fold.rows[0])) - np.einsum(
            "mp,np->mn", basis[0][fold.rows[0]], basis[0][fold.rows[0]]
        ))  # fmt: skip
        if values.min() < 0.01:
            continue  # what only these rows determine is predicted by nothing
        design, target = whole[~out], residual[~out]
        coefficients = np.linalg.lstsq(design, target, rcond=1e-9)[0]
        error = residual[out] - whole[out] @ coefficients
        squares += float(error @ error)
        count += int(out.sum())
        alone = held_out_by_poses(residual, columns.reshape(-1, 2), [fold])
        assert alone == pytest.approx(float(np.sqrt(error @ error / len(error))), rel=1e-6)
    assert count > 100


def test_an_effect_that_cannot_be_fitted_is_left_out_and_named(virtual_campaigns, monkeypatch):
    from monitor.discovery.machine import fit as module

    campaign, _ = virtual_campaigns.virtual(1, days=1, runs_per_day=2)
    problem = problem_of(campaign)
    first = fit(problem)
    chain = problem.context.chain
    good, bad = parse_effect("EXX:reversal", chain), parse_effect("EYX:poly2", chain)
    solve = module.solve_problem

    def refusing(tried, *others):
        if bad in tried.added:
            raise DataError("the identification did not converge")
        return solve(tried, *others)

    monkeypatch.setattr(module, "solve_problem", refusing)
    fitted, unfitted = fit_those_possible(problem, [bad, good], first.left_out, first)
    assert unfitted == (bad,)
    assert fitted.problem.added == (good,)


def test_explain_names_what_could_not_be_fitted_and_blames_no_file(virtual_campaigns, monkeypatch):
    from monitor.discovery.machine import fit as module

    sim = simulator()
    campaign, _ = virtual_campaigns.virtual(
        1, [sim.Effect("EXX:reversal", peak_um=5.0)], days=1, runs_per_day=2
    )
    solve = module.solve_problem

    def refusing(tried, *others):
        if any(effect.text == "EXX:reversal" for effect in tried.added):
            raise DataError("the identification did not converge")
        return solve(tried, *others)

    monkeypatch.setattr(module, "solve_problem", refusing)
    answer = explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(1))
    assert "EXX:reversal" in answer.unfitted
    assert all(found.effect != "EXX:reversal" for found in answer.missing)


def test_a_warm_up_of_two_time_constants_is_told_although_few_runs_show_it(
    virtual_campaigns, trial, explained
):
    """The first run of each day shows it: random signs of whole runs cannot tell it from noise, those of blocks can."""
    right, effect, curve = trial.FAMILIES["two time constants"]
    hidden = simulator().Effect(effect, peak_um=8.0, curve=curve)
    campaign, _ = virtual_campaigns.virtual(0, [hidden], days=2, runs_per_day=4)
    (found,) = explained(campaign).missing
    assert found.effect.partition(":")[0] in right
