"""One grossly wrong reading stops nothing and is named; data without one are fitted as ever, to the last bit."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from by_path import load

from monitor.discovery import fit, robust_fit
from monitor.exceptions import DataError
from monitor.methods import campaign_method
from monitor.methods.chain.gross import gross_readings
from monitor.methods.chain.parts import parts_of
from monitor.methods.model import Model
from monitor.readers import read_campaign
from monitor.readers.row_places import RowPlaces
from monitor.workflow.campaign_parts import without_runs
from monitor.workflow.identify.notes import gross_noted
from monitor.workflow.intake.gross_doubts import gross_doubts

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
wrong = load("gross_readings", Path(__file__).with_name("gross_readings.py"))

SIZES = (0.05, -0.5, 5.0, -50.0)


def problem_of(campaign, model=None):
    method = campaign_method(campaign)
    return method.problem_of(campaign, model or method.own_model)


def second_run(campaign):
    runs = np.unique(campaign.probings.run)
    return np.flatnonzero(campaign.probings.run == runs[min(1, len(runs) - 1)])


@pytest.mark.parametrize("machine", ["trunnion", pytest.param("one rotary table", marks=pytest.mark.slow)])
def test_a_wrong_reading_of_a_ball_is_the_one_that_is_named(virtual_campaigns, seeds, machine):
    campaign = virtual_campaigns.on_machine(machine, 5)[0]
    rows, axes = second_run(campaign), ("X", "Y", "Z")
    rng = np.random.default_rng(7)
    for trial in seeds(len(rows) * len(SIZES), 6):
        row, size = int(rng.choice(rows)), SIZES[trial % len(SIZES)]
        axis = str(rng.choice(axes))
        robust = robust_fit(problem_of(wrong.with_wrong_reading(campaign, row, axis, size)))
        assert [reading.row for reading in robust.gross] == [row], (row, axis, size)
        # A ball that the run touches once (those of the bar) is known from the other runs alone, to their placement.
        assert robust.gross[0].axis == axis.lower()
        assert robust.gross[0].size == pytest.approx(size, abs=0.01)
        clean = fit(replace(problem_of(campaign)), robust.fit.left_out)
        determined = robust.fit.solution.local_free & clean.solution.local_free
        difference = np.where(determined, robust.fit.solution.local - clean.solution.local, 0.0)
        # The numbers are those of the campaign without the row, whatever stood in it.
        assert np.abs(difference).max() < 1e-9


@pytest.mark.parametrize("off", [0.015, 0.03])
def test_a_touch_that_every_run_reads_off_alike_is_no_wrong_reading(virtual_campaigns, off):
    """An error of the machine at one pose; in one run alone, or half a millimetre off in all, it is a mistake."""
    campaign = virtual_campaigns.virtual(5, days=1, runs_per_day=4, noise_um=1.0)[0]
    in_every_run = np.flatnonzero(campaign.probings.sequence == 29)
    everywhere, far = campaign, campaign
    for row in in_every_run.tolist():
        everywhere = wrong.with_wrong_reading(everywhere, row, "X", off)
        far = wrong.with_wrong_reading(far, row, "X", 0.5)
    assert robust_fit(problem_of(everywhere)).gross == ()
    assert gross_readings(problem_of(everywhere)) == ()
    assert [reading.row for reading in robust_fit(problem_of(far)).gross] == in_every_run.tolist()
    row = int(in_every_run[2])
    alone = robust_fit(problem_of(wrong.with_wrong_reading(campaign, row, "X", 2.0 * off)))
    assert [reading.row for reading in alone.gross] == [row]


@pytest.mark.parametrize("off", [5.0, -5.0, 50.0])
@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
def test_a_touch_that_stands_apart_is_named_by_the_reading_that_is_wrong_along_the_surface_too(axis, off):
    campaign = read_campaign(EXAMPLES / "tilting-table")
    row = int(second_run(campaign)[41])
    (reading,) = robust_fit(problem_of(wrong.with_wrong_reading(campaign, row, axis, off))).gross
    assert (reading.row, reading.axis) == (row, axis.lower())
    assert reading.size == pytest.approx(off, abs=0.1)


@pytest.mark.parametrize(
    "off", [{"S1": -50.0}, {"S1": 30.0}, {"S1": -30.0, "S2": 10.0}], ids=["S1", "S1 less", "both"]
)
def test_the_other_end_of_the_bar_is_not_named_with_the_one_that_is_wrong(off):
    """In run 8 both were, since each alone explains the bar's length; the other runs tell them apart."""
    campaign = read_campaign(EXAMPLES / "five-days")
    probings, rows = campaign.probings, []
    for target, size in off.items():
        (row,) = np.flatnonzero((probings.run == 8) & (probings.target == target))
        campaign = wrong.with_wrong_reading(campaign, row, "Y", size)
        rows.append(row)
    gross = robust_fit(problem_of(campaign)).gross
    assert [reading.row for reading in gross] == rows
    assert [reading.size for reading in gross] == pytest.approx(list(off.values()), abs=0.05)
    if off == {"S1": -50.0}:
        # A fit of one run after the other asks no other run: it names both ends, as the import does.
        with pytest.raises(DataError, match=r"run 8, sequence 1[34] \(S[12]\) or sequence 1[34] of that run"):
            campaign_method(campaign).identify(campaign)


def test_a_ball_of_the_bar_that_half_of_the_runs_contradict_is_taken_from_none_of_them(virtual_campaigns):
    """Its backlash is on one side on one day, on the other the next: without it no run has a bar."""
    campaign = virtual_campaigns.virtual(31, days=2, runs_per_day=2, runs=4)[0]
    ball = campaign.probings.target == "S2"
    for row in np.flatnonzero(ball).tolist():
        off = 0.009 if campaign.probings.run[row] <= 2 else -0.009
        campaign = wrong.with_wrong_reading(campaign, row, "X", off)
    robust = robust_fit(problem_of(campaign))
    assert robust.gross == ()
    # It has a place of its own in every run: the fit does not see it.
    assert robust.fit.rms < 1.5e-3


@pytest.mark.parametrize("example", ["tilting-table", "free-form-pocket", "tracked-robot"])
@pytest.mark.parametrize("size", [0.5, 50.0])
def test_other_methods_find_it_too(example, size):
    campaign = read_campaign(EXAMPLES / example)
    row = int(second_run(campaign)[40])
    if example == "tracked-robot":
        channels = dict(campaign.probings.channels)
        channels["tracker_y_mm"] = channels["tracker_y_mm"].copy()
        channels["tracker_y_mm"][row] += 10.0 * size
        spoiled = replace(campaign, probings=replace(campaign.probings, channels=channels))
    else:
        axis = wrong.along_normal(campaign, problem_of(campaign), row)
        spoiled = wrong.with_wrong_reading(campaign, row, axis, size)
    assert [reading.row for reading in robust_fit(problem_of(spoiled)).gross] == [row]


@pytest.mark.parametrize(
    "example", ["five-days", "hidden-loose-ball", "hidden-reversal-x", "tilting-table", "l-shape"]
)
def test_without_a_gross_reading_the_fit_is_plain_least_squares_to_the_last_bit(example):
    problem = problem_of(read_campaign(EXAMPLES / example))
    robust, plain = robust_fit(problem), fit(problem)
    assert robust.gross == ()
    assert np.array_equal(robust.fit.solution.local, plain.solution.local)
    assert not robust.fit.left_out.any()


def test_the_drop_is_that_of_a_fit_without_the_row(virtual_campaigns):
    """The independent computation: numpy's least squares of one run, with the row and without it."""
    campaign = virtual_campaigns.on_machine("trunnion", 3, noise_um=1.0)[0]
    row = int(second_run(campaign)[17])
    problem = problem_of(wrong.with_wrong_reading(campaign, row, "Z", 0.3))
    run = int(np.flatnonzero(problem.runs == problem.context.run[row])[0])
    at = problem.linearise(problem.start, problem.common_start)
    usual = np.zeros((int(problem.is_limited.sum()), at.local.shape[2]))
    usual[np.arange(len(usual)), np.flatnonzero(problem.is_limited)] = 1.0 / (0.01 * problem.largest_error)
    columns = np.concatenate([at.local[run], usual])
    residual = np.concatenate([at.residual[run], np.zeros(len(usual))])
    first = int(np.flatnonzero(np.flatnonzero(problem.context.run == problem.runs[run]) == row)[0])
    others = np.ones(len(residual), dtype=bool)
    others[3 * first : 3 * first + 3] = False

    def remainder(rows):
        solution = np.linalg.lstsq(columns[rows], residual[rows], rcond=1e-9)[0]
        return float(np.sum((residual[rows] - columns[rows] @ solution) ** 2))

    (reading,) = gross_readings(problem)
    assert reading.row == row
    assert reading.chi_square == pytest.approx(remainder(np.ones_like(others)) - remainder(others), rel=1e-4)


def test_the_sentence_says_run_row_ball_pose_and_size(virtual_campaigns):
    campaign = virtual_campaigns.on_machine("trunnion", 5)[0]
    row = int(second_run(campaign)[5])
    spoiled = wrong.with_wrong_reading(campaign, row, "Y", 0.5)
    (sentence,) = gross_doubts(spoiled)
    target = campaign.probings.target[row]
    assert sentence.startswith(f"run 2: sequence 6, ball {target} at ")
    assert " is off by +0.5 mm in y: no number of this run holds" in sentence
    assert gross_doubts(campaign) == ()
    method = campaign_method(spoiled)
    (reading,) = method.identify(spoiled, Model("samba")).gross
    assert str(gross_noted(reading, method.nouns.target, RowPlaces(spoiled))) == sentence


def test_a_reading_that_hardly_moves_its_run_is_said_to(virtual_campaigns):
    """Was: "no number of this run holds" of one reading of 2.4 um, which moved them by 0.06 u."""
    campaign = without_runs(virtual_campaigns.on_machine("trunnion", 5)[0], range(3, 21))
    method = campaign_method(campaign)
    right = method.identify(campaign).runs[1]
    u = np.sqrt(np.diag(right.covariance))
    for size in (0.015, 0.05):
        spoiled = wrong.with_wrong_reading(campaign, int(second_run(campaign)[5]), "Y", size)
        found = method.identify(spoiled)
        (reading,) = found.gross
        moved = float(np.nanmax(np.abs(found.runs[1].estimate - right.estimate) / u))
        # The run's own noise of that reading is in what it is held against.
        assert reading.moves == pytest.approx(moved, rel=0.3)
        sentence = str(gross_noted(reading, method.nouns.target, RowPlaces(spoiled)))
        held = f"it moves the geometric errors of this run by up to {reading.moves:.2g} times the stated u"
        assert (held if reading.moves < 1.0 else "no number of this run holds") in sentence


def test_identify_says_which_reading_of_a_touch_far_off_is_wrong_and_what_would_be_right():
    campaign = read_campaign(EXAMPLES / "tilting-table")
    row = int(second_run(campaign)[41])
    typed = wrong.with_wrong_reading(campaign, row, "Y", 5.0)
    right = campaign.probings.readings["Y"][row]
    with pytest.raises(DataError, match="no number of their run would hold") as refusal:
        campaign_method(typed).identify(typed)
    number = r"(-?[\d.]+)"
    said = re.search(
        rf"y_mm is {number}, off by \+{number} mm; some {number} would be right", str(refusal.value)
    )
    assert said is not None
    assert [float(part) for part in said.groups()] == pytest.approx([right + 5.0, 5.0, right], abs=0.1)
    assert f"sequence {campaign.probings.sequence[row]} (point {campaign.probings.target[row]})" in str(
        refusal.value
    )


def longer(campaign, times):
    """A campaign whose runs touch everything so many times, with noise of 1 µm between the times."""
    probings, rng = campaign.probings, np.random.default_rng(11)
    rows = np.concatenate(
        [np.tile(np.flatnonzero(probings.run == run), times) for run in np.unique(probings.run)]
    )
    many = probings.rows(rows)
    sequence = np.concatenate([np.arange(1, np.sum(many.run == run) + 1) for run in np.unique(many.run)])
    readings = {
        axis: values + rng.normal(0.0, 1e-3, len(rows)) if axis in "XYZ" else values
        for axis, values in many.readings.items()
    }
    return replace(campaign, probings=replace(many, sequence=sequence, readings=readings))


@pytest.mark.parametrize("share", [0.7, 0.3])
def test_a_campaign_that_is_looked_at_in_parts_has_the_same_wrong_readings(
    virtual_campaigns, monkeypatch, share
):
    """Whole runs together, or a share of the rows of each: none is lost, none is looked at twice."""
    campaign = longer(virtual_campaigns.on_machine("trunnion", 5)[0], 6)
    row = int(second_run(campaign)[5])
    spoiled = wrong.with_wrong_reading(campaign, row, "Y", 0.5)
    (sentence,) = gross_doubts(spoiled)
    most = int(share * len(campaign.probings))
    monkeypatch.setattr("monitor.methods.chain.parts.MOST_TOGETHER", most)
    parts = [part.probings for _, part in parts_of(spoiled)]
    assert len(parts) > 1
    probings = spoiled.probings
    on_bar = np.isin(probings.target, campaign.artefact.scale_bar.balls)
    # The runs of a group share what is left over.
    assert max(map(len, parts)) <= most + len(campaign.runs) + on_bar.sum()

    def of(probings, rows):
        return list(zip(probings.run[rows].tolist(), probings.sequence[rows].tolist(), strict=True))

    rows = [pair for part in parts for pair in of(part, slice(None))]
    assert set(rows) == set(of(probings, slice(None)))
    assert sorted(set(rows) - set(of(probings, on_bar))) == sorted(
        pair for pair in rows if pair not in of(probings, on_bar)
    )
    assert gross_doubts(spoiled) == (sentence,)
    assert gross_doubts(campaign) == ()
