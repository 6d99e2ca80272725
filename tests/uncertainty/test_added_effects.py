"""Added effects in the joint covariance of a run: what they scatter, other plans, and what is estimated together.

References: fits of readings moved by hand on a machine of plain matrices (``own_machine``), and plain draws.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from by_path import load

from monitor.discovery import fit
from monitor.methods import campaign_method
from monitor.methods.chain.shared_effects import followed_effects
from monitor.readers import read_campaign
from monitor.reporting.budget import HoldsFor
from monitor.sources import Quantity, Sharing, Source
from monitor.store.models import StoredModel
from monitor.uncertainty import measured_run, sensitivity_of
from monitor.uncertainty.runs.row_run import repeated_readings
from monitor.uncertainty.type_b import source_columns
from monitor.workflow.models import as_model
from monitor.workflow.selections.readings import SelectedReadings
from monitor.workflow.uncertainty.effect_scatter import _between_days, _beyond
from monitor.workflow.uncertainty.evaluation import evaluate_fit
from monitor.workflow.uncertainty.inputs import reading_inputs, readings_of_runs
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.with_effects import effect_outputs, source_effect
from tests.simulator import horizontal_centre as centre

own = load("own_machine", Path(__file__).resolve().parents[1] / "benchmarks" / "own_machine.py")

EFFECT = "EXX:reversal"
MODEL = StoredModel("own", 1, ("samba", 1), (EFFECT,), (EFFECT,), (), "", None)
PLAN = own.plan()
READINGS, OTHERS, SCATTER = "readings", "readings of the other runs", "scatter of the added effects"


@pytest.fixture(scope="module")
def touched():
    """The readings (n, 3) of the machine, and what 1 µm of backlash of X adds to them."""

    def backlash(reading, side, warm):
        motion = np.zeros((len(reading), 6))
        motion[:, 0] = 1e-3 * side
        return motion

    warm = np.zeros(len(PLAN))
    plain = own.OwnMachine().touched(PLAN, warm)
    return plain, own.OwnMachine(motions={"X": backlash}).touched(PLAN, warm) - plain


def campaign_of(touched, amplitudes, days, seed=1, noise=1e-3):
    """Runs with an amplitude (R,) of backlash each, µm."""
    plain, of_backlash = touched
    rng = np.random.default_rng(seed)
    readings = plain + np.asarray(amplitudes)[:, None, None] * of_backlash
    readings = readings + noise * rng.standard_normal(readings.shape)
    return own.recorded(PLAN, readings, np.asarray(days))


def fitted(campaign):
    return fit(campaign_method(campaign).problem_of(campaign, as_model(MODEL)))


def evaluated(campaign, fit_, run=None, selected=None):
    request = UncertaintyRequest(
        campaign.name, run, method="guf", model_uncertainty=False, select=selected and selected.name
    )
    return evaluate_fit(campaign, MODEL, fit_, request, selected)


def short(campaign, run, count):
    """The campaign without the last ``count`` touches of a run."""
    told = campaign.probings
    return replace(campaign, probings=told.rows(~((told.run == run) & (told.sequence > len(PLAN) - count))))


def test_a_run_takes_up_what_its_own_effect_is_off_the_mean(touched) -> None:
    """What one more micrometre in this run, and in another, moves is found by fits; the runs are independent."""
    amplitudes, runs = np.array([0.0, 5.0, 1.5, 3.0, -1.0, 2.5]), 6
    campaign = campaign_of(touched, amplitudes, np.zeros(runs))
    base = fitted(campaign)
    result = evaluated(campaign, base, run=6)
    names = result.framework.names

    def moved(run: int) -> np.ndarray:
        more = amplitudes + (np.arange(runs) == run)
        other = fitted(campaign_of(touched, more, np.zeros(runs)))
        places = [base.problem.base_names.index(name) for name in names[:-1]]
        own_part = other.solution.local[5] - base.solution.local[5]
        return np.append(own_part[places], other.solution.common - base.solution.common)

    expected = np.zeros((len(names),) * 2)
    for weight, run in ((1, 5), (runs - 1, 0)):
        expected += weight * np.outer(moved(run), moved(run))
    lines = {line.source: line.covariance for line in result.framework.budget}
    assert SCATTER in lines
    assert lines[SCATTER][-1, -1] > 0.0
    # Their common size is what the runs show beyond their readings.
    of_readings = lines[READINGS][-1, -1] + lines[OTHERS][-1, -1]
    size = amplitudes.var(ddof=1) - runs * of_readings * 1e6
    expected *= size
    u = np.sqrt(np.diag(expected))
    clear = u > 1e-3 * np.sqrt(np.diag(result.framework.covariance))
    assert clear.sum() >= 5
    np.testing.assert_allclose(np.sqrt(np.diag(lines[SCATTER]))[clear], u[clear], rtol=0.1)
    ratio = (lines[SCATTER] / np.outer(u, u) - expected / np.outer(u, u))[np.ix_(clear, clear)]
    assert np.abs(ratio).max() < 0.2


def test_two_days_that_differ_are_known_to_one_degree_of_freedom(touched) -> None:
    """The mean of two days has half their difference for its standard uncertainty, and Student's t of 1 reaches far."""
    campaign = campaign_of(touched, [1.0, 1.0, 1.0, 3.5, 3.5, 3.5], [0, 0, 0, 1, 1, 1])
    fit_ = fitted(campaign)
    result = evaluated(campaign, fit_)
    (scatter,) = [line for line in result.framework.budget if line.source == SCATTER]
    assert scatter.dof == 1.0
    by_run = followed_effects(fit_.problem, fit_.solution).estimate[:, 0]
    apart = by_run[3:].mean() - by_run[:3].mean()
    assert result.framework.u[-1] == pytest.approx(abs(apart) / 2.0, rel=1e-6)
    # Readings alone would have 2.87; what they leave of u bounds the quantile of one degree of freedom, 12.7.
    assert 4.0 < result.framework.k_q < 12.8


def test_days_of_an_effect_stand_beside_those_of_the_parameters(touched) -> None:
    """One-way analysis of variance of the amplitudes written into the machine, as good as without noise."""
    amplitudes = np.array([1.0, 1.2, 3.0, 3.2, 5.0, 5.2])
    campaign = campaign_of(touched, amplitudes, [0, 0, 1, 1, 2, 2], noise=1e-5)
    result = evaluated(campaign, fitted(campaign))
    days = result.behind.day_to_day
    assert days.spread[EFFECT] == pytest.approx(4.0, abs=0.02)
    assert days.u_day[EFFECT] == pytest.approx(math.sqrt(4.0 - 0.02 / 2.0), abs=0.02)
    assert days.u_day.keys() == {*result.framework.names}


def test_what_holds_over_a_campaign_has_the_days_of_an_effect_without_a_test(touched) -> None:
    """Nine runs on three days that differ by less than a test sees: u is the scatter of the days' means."""
    amplitudes = np.repeat([1.8, 2.0, 2.2], 3) + np.tile([-0.3, 0.0, 0.3], 3)
    campaign = campaign_of(touched, amplitudes, np.repeat([0, 1, 2], 3))
    fit_ = fitted(campaign)
    by_run = followed_effects(fit_.problem, fit_.solution).estimate[:, 0].reshape(3, 3)
    of_days = by_run.mean(axis=1).std(ddof=1) / math.sqrt(3.0)
    result = evaluated(campaign, fit_)
    assert result.behind.holds_for is HoldsFor.CAMPAIGN
    assert result.framework.u[-1] >= 0.999 * of_days
    drawn, inside = np.random.default_rng(58), 0
    for _ in range(2000):
        day = np.repeat(drawn.standard_normal(5), 4)
        values = day + drawn.standard_normal(20)
        beyond = _between_days(values, np.repeat(np.arange(5), 4), 1.0 / 20.0)
        added = beyond[0].variance / 5.0 if beyond else 0.0
        inside += abs(values.mean()) <= 2.78 * math.sqrt(1.0 / 20.0 + added)
    # Student's law of four degrees of freedom has 95 % there; with the test of 5 % it is 92.9 there.
    assert inside > 0.945 * 2000


def one_way(campaign, runs):
    """The campaign in whose ``runs`` the bar is first and X goes down alone after it: play of X shows in none."""
    told = campaign.probings
    bar, x = np.char.startswith(told.target, "S"), told.readings["X"]
    late = np.isin(told.run, runs)
    kept = np.flatnonzero(~late | bar | (x < x[bar].min()))
    order = np.where(late & ~bar, -x, told.sequence - 1000.0 * (bar & late))
    along = kept[np.lexsort((order[kept], told.run[kept]))]
    at = told.rows(kept)
    return replace(campaign, probings=replace(told.rows(along), sequence=at.sequence, time=at.time))


def test_an_effect_of_two_of_three_days_has_what_these_two_differ_by(touched) -> None:
    """Half the difference of the two days, to one degree of freedom, beside what the readings give."""
    whole = campaign_of(touched, np.full(9, 2.0), np.arange(9), seed=3)
    selected = SelectedReadings("weeks", repeated_readings(fitted(whole).problem), np.arange(9))
    amplitudes = [0.0, 0.1, 0.05, 6.0, 6.1, 5.9, 3.0, 3.0, 3.0]
    campaign = one_way(campaign_of(touched, amplitudes, np.repeat([0, 1, 2], 3)), (7, 8, 9))
    fit_ = fitted(campaign)
    by_run = followed_effects(fit_.problem, fit_.solution).estimate[:, 0]
    assert np.isfinite(by_run).tolist() == [True] * 6 + [False] * 3
    result = evaluated(campaign, fit_, 1, selected)
    assert result.behind.holds_for is HoldsFor.CAMPAIGN
    (scatter,) = [line for line in result.framework.budget if line.source == SCATTER]
    assert scatter.dof == 1.0
    apart = by_run[3:6].mean() - by_run[:3].mean()
    assert result.framework.u[-1] == pytest.approx(abs(apart) / 2.0, rel=0.01)


@pytest.mark.parametrize("dof", [math.inf, 12.0])
@pytest.mark.parametrize(("days", "per_day"), [(1, 2), (1, 5), (2, 3), (3, 4), (6, 1)])
def test_calm_effects_are_said_to_scatter_in_5_percent_at_most(days: int, per_day: int, dof: float) -> None:
    rng, runs, calm = np.random.default_rng(57), days * per_day, 2000
    labels = np.repeat(np.arange(days), per_day)
    called = 0
    for _ in range(calm):
        estimated = 1.0 if math.isinf(dof) else rng.chisquare(dof) / dof
        called += bool(_beyond(rng.standard_normal(runs), labels, 0, estimated / runs, dof, 0.05))
    # Four standard errors above 5 %; two tests that lean on each other may come to less.
    assert 0.02 * calm < called < (0.05 + 4.0 * math.sqrt(0.05 * 0.95 / calm)) * calm


def test_nine_runs_say_of_an_effect_what_eight_degrees_of_freedom_say(touched) -> None:
    campaign = campaign_of(touched, np.full(9, 2.0), np.zeros(9))
    result = evaluated(campaign, fitted(campaign))
    assert result.effects == (EFFECT,)
    assert SCATTER not in {line.source for line in result.framework.budget}
    assert result.framework.dof_by_output[-1] == pytest.approx(8.0, rel=1e-3)


def test_a_selection_of_whole_runs_serves_a_campaign_with_an_aborted_one(touched) -> None:
    whole = campaign_of(touched, np.full(12, 2.0), np.repeat([0, 1, 2], 4), seed=3)
    problem = fitted(whole).problem
    selected = SelectedReadings("weeks", repeated_readings(problem), np.repeat([0, 1, 2], 4))
    campaign = campaign_of(touched, np.full(4, 2.0), np.zeros(4), seed=4)
    aborted = short(campaign, 4, 8)
    first = evaluated(campaign, fitted(campaign), 1, selected)
    second = evaluated(aborted, fitted(aborted), 1, selected)
    lines = [{line.source: line.covariance for line in each.framework.budget} for each in (first, second)]
    sizes = [math.sqrt(each[OTHERS][-1, -1]) for each in lines]
    # Three runs, one of them with 8 of its touches less, whose readings are taken as the largest of the selection.
    assert 0.8 * sizes[0] < sizes[1] < 3.0 * sizes[0]


def test_a_run_cut_short_keeps_the_resemblance_of_its_neighbours(touched) -> None:
    rng, plain = np.random.default_rng(8), touched[0]
    noise = rng.standard_normal((4, *plain.shape))
    for touch in range(1, len(PLAN)):
        noise[:, touch] = 0.8 * noise[:, touch - 1] + 0.6 * noise[:, touch]
    readings = plain + 2.0 * touched[1] + 1e-3 * noise
    campaign = short(own.recorded(PLAN, readings, np.zeros(4)), 2, 8)
    of_all = fitted(campaign)
    fixed, coefficients = of_all.problem.resolved(of_all.solution.common)
    runs = [measured_run(fixed, number, coefficients) for number in (1, 2, 3, 4)]
    inputs, source = reading_inputs(of_all, campaign, runs[0], None)
    assert source.neighbours
    first, cut, *_ = readings_of_runs(of_all, campaign, runs, 0, inputs, None)
    count = len(cut)
    assert count == len(first) - 24
    np.testing.assert_allclose(cut, first[:count, :count], rtol=0.05, atol=0.02 * first.max())
    assert abs(cut[0, 3]) > 0.2 * cut[0, 0]


def test_values_of_a_source_are_added_over_runs_by_what_they_are_of(touched) -> None:
    """Run 1 leaves out a ball at some poses, run 2 another at as many: each has a form of its own at each of them."""
    campaign = campaign_of(touched, np.full(2, 2.0), np.zeros(2))
    told = campaign.probings
    third, fourth = (np.flatnonzero((told.run == 1) & (told.target == ball))[-3:] for ball in "34")
    left_out = np.concatenate([fourth, third + len(PLAN)])
    campaign = replace(campaign, probings=told.rows(~np.isin(np.arange(2 * len(PLAN)), left_out)))
    source = Source(name="form", quantity=Quantity.BALL_FORM, size=1e-3, shared_by=Sharing.ALL_RUNS)
    of_all = fitted(campaign)
    at = sensitivity_of(measured_run(*_held(of_all, 1)), start=of_all.solution.local[0])
    names = [name for name in of_all.problem.base_names if at.determined[at.names.index(name)]]
    effects = effect_outputs(of_all, 0, [of_all.problem.base_names.index(name) for name in names])
    parts = [
        source_columns(run, local, campaign, number, (source,))[0]
        for run, local, number in zip(effects.runs, effects.unknowns, (1, 2), strict=True)
    ]
    of_run = at.rows(tuple(names))
    moved: dict[tuple, np.ndarray] = {}
    for run, part in enumerate(parts):
        rows = effects.by_run[run] + (effects.padded(of_run) if run == 0 else 0.0)
        context, times = effects.runs[run].problem.context, Counter()
        for column in part.columns.T:
            touch = int(np.flatnonzero(column)[0]) // 3
            turning = [index for index, joint in enumerate(context.chain.joints) if joint.turns]
            pose = (str(context.target[touch]), *np.round(context.positions[touch, turning], 6).tolist())
            name = (*pose, times[pose])
            times[pose] += 1
            moved[name] = moved.get(name, 0.0) + rows @ column
    expected = sum(np.outer(each, each) for each in moved.values())
    assert parts[0].columns.shape == parts[1].columns.shape
    assert len(moved) == parts[0].columns.shape[1] + 9
    line = source_effect(effects, of_run, parts, [0, 0]).line.covariance
    size = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(line / np.outer(size, size), expected / np.outer(size, size), atol=1e-9)


def _held(of_all, number):
    fixed, coefficients = of_all.problem.resolved(of_all.solution.common)
    return fixed, number, coefficients


def test_a_tool_point_of_every_run_is_no_quantity_of_all_runs(tmp_path) -> None:
    """All unknowns of both runs side by side, solved at once with numpy: what is stated of either run's tool point."""
    rng = np.random.default_rng(9003)
    folder = centre.campaign(tmp_path / "shop", rng, centre.truth_of(rng), only="r-test")
    file, point = folder / "campaign.toml", f"tool_point_mm = {centre.TOOL.tolist()}\n"
    text = file.read_text(encoding="utf-8")
    file.write_text(
        text.replace(point, f"{point}tool_point_standard_uncertainty_mm = 0.01\n"), encoding="utf-8"
    )
    header, *rows = (folder / "probings.csv").read_text(encoding="utf-8").splitlines()
    again = ["2" + row[1:] for row in rows]
    (folder / "probings.csv").write_text("\n".join([header, *rows, *again, ""]), encoding="utf-8")
    header, first, *_ = (folder / "runs.csv").read_text(encoding="utf-8").splitlines()
    second = first.replace("1,2026-03-02T20", "2,2026-03-02T22", 1)
    (folder / "runs.csv").write_text("\n".join([header, first, second, ""]), encoding="utf-8")
    campaign = read_campaign(folder)
    text = "EAA:harmonic1"
    base = as_model(StoredModel("own", 1, None, (text,), (text,), (), "", None))
    of_all = fit(campaign_method(campaign).problem_of(campaign, base))
    solution, unknowns = of_all.solution, len(of_all.problem.local_names)
    extras = len(of_all.problem.extra_names)
    assert extras > 0
    at = of_all.problem.linearise(solution.local, solution.common)
    numbers, common = at.local.shape[1], at.common.shape[2]
    dense = np.zeros((2, numbers, 2 * unknowns + common))
    for run in range(2):
        dense[run, :, run * unknowns : (run + 1) * unknowns] = at.local[run]
    dense[..., 2 * unknowns :] = at.common[..., :common]
    dense = dense.reshape(2 * numbers, -1)
    scale = np.linalg.norm(dense, axis=0)
    scale[scale == 0.0] = 1.0
    answer = (np.linalg.pinv(dense / scale, rcond=1e-9) / scale[:, None]).reshape(-1, 2, numbers)
    of_stated = answer[2 * unknowns :, :, numbers - extras :].reshape(common, -1)
    effects = effect_outputs(of_all, 0, [])
    assert effects.names
    own_run = effects.linear[:, len(effects.runs[0].reading_names) :]
    together = own_run @ own_run.T + effects.known_in_other_runs.covariance
    expected = (of_stated @ of_stated.T)[np.ix_(effects.columns, effects.columns)]
    # The cosine is a shift of the tool point across the head's axis, the sine hardly any.
    assert math.sqrt(expected[0, 0]) > 0.01 * math.sqrt(solution.common_covariance[0, 0])
    np.testing.assert_allclose(together, expected, rtol=1e-3, atol=1e-6 * expected[0, 0])
