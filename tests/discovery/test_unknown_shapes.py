"""Shapes that the catalogue does not have: the right error alone, and a model to which it is added is complete.

All families are in tests/benchmarks/trial_unknown.py; here three of them.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import scipy
from by_path import load, simulator

from monitor.discovery import explain, fit
from monitor.discovery.machine.evidence.acceptance import ChainAcceptance
from monitor.discovery.machine.evidence.held_out import held_out_by_poses, pose_folds
from monitor.discovery.machine.explain import variants_of_campaign
from monitor.discovery.machine.fit import fit_those_possible
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.curves import beyond_base
from monitor.discovery.machine.surroundings import surroundings_of
from monitor.discovery.search.candidate import Variant
from monitor.effects import parse_effect
from monitor.effects.shapes.free import Free, flexible_basis, way_since_reversal
from monitor.exceptions import DataError
from monitor.methods.model import Model
from monitor.methods.samba.method import problem_of
from monitor.readers import read_campaign
from monitor.records import Campaign


@pytest.fixture(scope="module")
def trial():
    return load("trial_unknown", Path(__file__).resolve().parents[1] / "benchmarks" / "trial_unknown.py")


@pytest.mark.parametrize(
    "family",
    [
        "X times B",
        "fifth harmonic of C",
        pytest.param("play over 40 mm", marks=pytest.mark.all_seeds),
    ],
)
@pytest.mark.slow
def test_the_right_error_alone_is_named(virtual_campaigns, trial, explained, family):
    right, effect, curve = trial.FAMILIES[family]
    hidden = simulator().Effect(effect, peak_um=5.0, curve=curve)
    campaign, _ = virtual_campaigns.virtual(4, [hidden], days=2)
    (found,) = explained(campaign).missing
    assert found.effect.partition(":")[0] in right
    assert found.held_out_after == pytest.approx(1e-3, rel=0.05)
    assert found.held_out_poses_after < found.held_out_poses_before
    if family == "fifth harmonic of C":
        # Of the shapes that have no name in the catalogue the waves have one.
        assert found.effect == "ECC:harmonic5"
    else:
        assert found.nearest is not None
        assert len(found.curve.at) > 10
    grown = problem_of(campaign, Model("grown", added=(found.effect,)))
    again = explain(campaign, grown, "grown", rng=np.random.default_rng(1))
    assert again.missing == again.not_followed == ()


@pytest.mark.slow
def test_what_a_shape_that_was_added_does_not_follow_is_no_effect_of_another_error(virtual_campaigns):
    """A step within 0.2 mm is no part of a free shape: `ECX:free(6)` of 3.8 µm was told beside it, and the warm-up that
    is there was not."""
    step = simulator().Effect(
        "EXX:curve", peak_um=8.0, curve=lambda q, travel, now: np.tanh(5.0 * (q - 12.0))
    )
    more = simulator().Effect("EZC1:const@warmup", peak_um=6.0)
    campaign, _ = virtual_campaigns.virtual(400, [step, more], days=1, runs_per_day=4)
    grown = problem_of(campaign, Model("grown", added=("EXX:free(6,36,37,44,45,46)",)))
    again = explain(campaign, grown, "grown", rng=np.random.default_rng(1))
    assert [found.effect for found in again.missing] == ["EZC1:const@warmup"]
    assert again.not_followed == ("EXX",)


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


@pytest.mark.slow
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


@pytest.mark.slow
def test_a_warm_up_of_two_time_constants_is_told_although_few_runs_show_it(
    virtual_campaigns, trial, explained
):
    """The first run of each day shows it: random signs of whole runs cannot tell it from noise, those of blocks can."""
    right, effect, curve = trial.FAMILIES["two time constants"]
    hidden = simulator().Effect(effect, peak_um=8.0, curve=curve)
    campaign, _ = virtual_campaigns.virtual(0, [hidden], days=2, runs_per_day=4)
    (found,) = explained(campaign).missing
    assert found.effect.partition(":")[0] in right


@pytest.mark.slow
def test_a_bump_that_another_error_mimics_in_part_is_the_error_of_its_axis(
    virtual_campaigns, trial, explained
):
    """A small cycle of another axis stood the scan first, and everything else lay within that axis in any shape."""
    _, effect, curve = trial.FAMILIES["wear bump"]
    hidden = simulator().Effect(effect, peak_um=8.0, curve=curve)
    campaign, _ = virtual_campaigns.virtual(1, [hidden], days=2, runs_per_day=4)
    (found,) = explained(campaign).missing
    assert found.effect.partition(":")[0] == "EYX"


@pytest.mark.parametrize(
    ("family", "seed"),
    [
        ("joint of two rails", 300),
        ("wear bump", 302),
        pytest.param("step in a scale", 301, marks=pytest.mark.all_seeds),
    ],
)
@pytest.mark.slow
def test_a_slight_step_or_bump_is_the_error_of_its_axis(virtual_campaigns, trial, explained, family, seed):
    """The three were told as EZY:free, EYB:harmonic2 and EBX:free: hats alone make a step of a mixture that an error of
    another axis mimics, and a harmonic that a fifth of a bump looks like was left unquestioned."""
    right, effect, curve = trial.FAMILIES[family]
    hidden = simulator().Effect(effect, peak_um=3.0, curve=curve)
    campaign, _ = virtual_campaigns.virtual(seed, [hidden], days=2, runs_per_day=4)
    (found,) = explained(campaign).missing
    assert found.effect.partition(":")[0] in right


@pytest.mark.slow
def test_a_slight_wave_of_eight_periods_is_named_as_that(virtual_campaigns, trial, explained):
    # 5.3 standard deviations of both coefficients together; neither alone stands among 1 700 parts.
    _, effect, curve = trial.FAMILIES["eighth harmonic of C"]
    hidden = simulator().Effect(effect, peak_um=3.0, curve=curve)
    campaign, _ = virtual_campaigns.virtual(700, [hidden], days=2)
    (named,) = explained(campaign).missing
    assert named.effect == "ECC:harmonic8"
    assert named.q_value < 0.01


def test_later_parts_of_a_free_shape_stand_behind_the_earlier_ones(virtual_campaigns):
    """Names that are stored keep their numbers: behind those of the first versions come one step in the middle between
    every two hats of linear axes, then play of three widths and the rows before an axis first moves."""
    campaign, _ = virtual_campaigns.virtual(1, days=1, runs_per_day=2, noise_um=0.0)
    context = problem_of(campaign).context
    for joint, axis in enumerate(context.chain.joints):
        basis = flexible_basis(context, joint)
        position = context.places[:, joint]
        np.testing.assert_array_equal(basis[:, -1], context.travel[:, joint] == 0.0)
        if axis.turns or not np.ptp(position):
            np.testing.assert_allclose(basis[:, 0], np.cos(position) / np.abs(np.cos(position)).max())
            continue
        nodes = np.linspace(position.min(), position.max(), 12)
        hats, steps = basis[:, :12], basis[:, -15:-4]
        for number, (left, right) in enumerate(pairwise(nodes)):
            inside = np.abs(position - left) < 0.2 * (right - left)
            assert np.all(hats[inside, number] > 0.0)
            assert np.all(steps[position > right, number] > 0.9)
            assert np.all(steps[position < left, number] < -0.9)


@pytest.mark.slow
def test_a_part_that_follows_a_temperature_late_has_its_time_constant(virtual_campaigns, trial, explained):
    _, effect, curve = trial.FAMILIES["lag behind a temperature"]
    hidden = simulator().Effect(effect, peak_um=8.0, curve=curve)
    campaign, _ = virtual_campaigns.virtual(3, [hidden], days=2, runs_per_day=4)
    (found,) = explained(campaign).missing
    assert found.effect == "EXX:poly1@lagged_x_axis_degC"
    assert found.searched.value == pytest.approx(25.0, abs=3.0 * found.searched.u)


def test_what_lies_within_the_shape_of_a_named_error_is_said_not_separable(virtual_campaigns, trial):
    """Beside the nearest entry of the catalogue effects of other errors stand out; beside all that the named error
    could do in any shape, by numpy's least squares, they do not."""
    _, effect, curve = trial.FAMILIES["wear bump"]
    hidden = simulator().Effect(effect, peak_um=5.0, curve=curve)
    campaign, _ = virtual_campaigns.virtual(1, [hidden], days=2, runs_per_day=2)
    problem = problem_of(campaign).for_search()
    drivers = surroundings_of(campaign, problem).drivers
    scene = scene_of(fit(problem), variants_of_campaign(campaign, problem, drivers))
    by_name = {candidate.family: candidate for candidate in scene.candidates}
    (names,) = ChainAcceptance(scene, drivers, 0.01).within_shapes([by_name["EYX:poly2"]])
    assert all(not name.startswith("EYX") for name in names)
    # Those of which one variant is looked at.
    names = tuple(name for name in names if by_name[name].variant.tries == 1)
    assert names
    named = parse_effect("EYX:poly2", problem.context.chain)
    any_shape = scene_of(scene.fit, [Variant("EYX:free", replace(named, shape=Free(), shape_text="free"))])

    def p_value(name: str, *others: np.ndarray) -> float:
        beside = np.column_stack(others)
        beside = beside[:, np.any(beside, axis=0)] / np.linalg.norm(beside[:, np.any(beside, axis=0)], axis=0)
        own = by_name[name].columns / np.linalg.norm(by_name[name].columns, axis=0)
        squares = [
            float(np.sum((scene.residual - x @ np.linalg.lstsq(x, scene.residual, rcond=1e-4)[0]) ** 2))
            for x in (beside, np.column_stack([beside, own]))
        ]
        number = own.shape[1]
        freedom = scene.degrees_of_freedom - np.linalg.matrix_rank(beside, tol=1e-4) - number
        f = (squares[0] - squares[1]) / number / (squares[1] / freedom)
        return float(scipy.stats.f.sf(f, number, freedom)) * by_name[name].variant.odds

    families = len({candidate.family for candidate in scene.candidates if candidate.visible})
    for name in names:
        assert p_value(name, by_name["EYX:poly2"].columns) * families < 0.01
        assert p_value(name, by_name["EYX:poly2"].columns, any_shape.candidates[0].columns) * families > 0.01
    # What its shape cannot do is named for itself, and a shape that is right has nothing within.
    right = simulator().Effect("EYX:poly2", peak_um=5.0)
    campaign, _ = virtual_campaigns.virtual(1, [right], days=2, runs_per_day=2)
    assert all(effect.within_its_shape == () for effect in _explained(campaign))


def _explained(campaign):
    return explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(1)).missing


@pytest.mark.parametrize(
    ("error", "has_slope"), [("ECC", True), ("EAC", True), ("EBX", True), ("EXX", False), ("EYX", False)]
)
def test_a_shape_is_without_a_slope_only_where_the_base_has_one(error: str, has_slope: bool) -> None:
    """Was: a free shape of C that grows in proportion to its angle had the size 0 (`ECC:free(48)` of 2.5 um)."""
    campaign = read_campaign(Path(__file__).resolve().parents[2] / "examples" / "hot-cold")
    assert isinstance(campaign, Campaign)
    context = problem_of(campaign).context
    shape = beyond_base(context, parse_effect(f"{error}:poly1", context.chain))[:, 0]
    assert (np.ptp(shape) > 1.0) == has_slope
    assert abs(shape.mean()) < 1e-9
