"""Added effects in the joint covariance of a run: what they scatter, other plans, and what is estimated together.

References: fits of readings moved by hand on a machine of plain matrices (``own_machine``), and plain draws.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from by_path import load

from monitor.discovery import fit
from monitor.methods import campaign_method
from monitor.store.models import StoredModel
from monitor.uncertainty.runs.row_run import measured_run, repeated_readings
from monitor.workflow.models import as_model
from monitor.workflow.selections.readings import SelectedReadings
from monitor.workflow.uncertainty.evaluation import evaluate_fit
from monitor.workflow.uncertainty.inputs import reading_inputs, readings_of_runs
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.with_effects import _beyond

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


def test_two_days_that_differ_are_no_part_of_one_degree_of_freedom(touched) -> None:
    campaign = campaign_of(touched, [1.0, 1.0, 1.0, 3.5, 3.5, 3.5], [0, 0, 0, 1, 1, 1])
    result = evaluated(campaign, fitted(campaign))
    (scatter,) = [line for line in result.framework.budget if line.source == SCATTER]
    assert scatter.dof == 5.0
    assert np.isfinite(result.framework.k_q)


@pytest.mark.parametrize("dof", [math.inf, 12.0])
@pytest.mark.parametrize(("days", "per_day"), [(1, 5), (2, 3), (3, 4), (6, 1)])
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
