"""Bad points, balls that moved, steps, and what varies: told as that, at rates over seeds."""

from __future__ import annotations

import numpy as np
import pytest
from by_path import simulator

from monitor.discovery import Verdict, fit
from monitor.discovery.machine.noise.plan_cells import plan_cells
from monitor.discovery.machine.suspects.anomalies import bad_points, ball_moves
from monitor.methods.samba.method import problem_of


def test_places_are_the_same_probing_of_every_run(virtual_campaigns):
    campaign, told = virtual_campaigns.virtual(1, days=1, runs_per_day=3)
    places = plan_cells(problem_of(campaign))
    assert len(set(places)) == 62
    for sequence in (1, 30, 62):
        assert len(set(places[told["sequence"] == sequence])) == 1


def test_places_of_plans_that_differ_go_by_what_was_probed(virtual_campaigns):
    campaign, _ = virtual_campaigns.virtual(
        1, days=1, runs_per_day=2, keep=lambda told: (told["run"] == 1) | (told["sequence"] > 20)
    )
    found = fit(problem_of(campaign))
    places = plan_cells(found.problem)
    context = found.problem.context
    second = np.flatnonzero(context.run == 2)
    for row in second[:10]:
        first = np.flatnonzero((context.run == 1) & (places == places[row]))
        assert len(first) == 1
        assert context.target[first[0]] == context.target[row]
        assert context.sequence[first[0]] == context.sequence[row]


def test_false_alarms_for_points_and_balls_are_as_rare_as_stated(virtual_campaigns, seeds):
    """At 1 % a campaign: 60 with more than four of either would be a chance of 1e-3, 8 with more than one of 3e-3."""
    points = moves = 0
    campaigns = seeds(60, 8)
    for seed in campaigns:
        campaign, _ = virtual_campaigns.virtual(seed, days=2, runs_per_day=3)
        found = fit(problem_of(campaign))
        points += bool(bad_points(found))
        moves += bool(ball_moves(found))
    most = {60: 4, 8: 1}[len(campaigns)]
    assert points <= most
    assert moves <= most


@pytest.mark.parametrize("freedom", [2, 3])
def test_no_ball_moved_in_noise_with_heavy_tails(virtual_campaigns, seeds, freedom):
    """Student's t with two and three degrees of freedom: 56 and 25 of 60 were told a ball, since one wild touch moved
    the mean of its neighbours, then 14 and 1, since it moved where the ball stands; 5 of 60 would be a chance of 4e-4
    at 1 %."""

    def tails(rng: np.random.Generator, run: np.ndarray) -> np.ndarray:
        return np.asarray(rng.standard_t(freedom, (len(run), 3)) / np.sqrt(3.0))

    campaigns = seeds(60, 6)
    told = [
        bool(ball_moves(fit(problem_of(virtual_campaigns.virtual(70000 + seed, days=1, noise=tails)[0]))))
        for seed in campaigns
    ]
    assert sum(told) <= len(campaigns) // 15


def test_a_ball_that_moved_by_a_few_micrometres_is_still_told(virtual_campaigns, seeds):
    """5 µm in white noise of 1 µm, in any direction, at any place of the last run: 39 of 40, as before."""
    sim = simulator()
    campaigns = seeds(40, 4)
    told = 0
    for seed in campaigns:
        rng = np.random.default_rng(71000 + seed)
        shift = rng.standard_normal(3)
        shift *= 5e-3 / np.linalg.norm(shift)
        ball, sequence = str(rng.integers(1, 5)), int(rng.integers(8, 50))
        loose = sim.Effect(f"ball:{ball}:moved", coefficients=shift, at=(4, sequence))
        found = fit(problem_of(virtual_campaigns.virtual(71000 + seed, [loose], days=1)[0]))
        told += any((move.target, move.run) == (ball, 4) for move in ball_moves(found))
    assert told >= 0.9 * len(campaigns)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.all_seeds) for seed in (1, 2))])
def test_bad_points_are_found_with_axis_and_size_and_are_no_effect(virtual_campaigns, explained, seed):
    bad = [(3, 9, (0.0, 60.0, 0.0)), (3, 40, (0.0, 0.0, -12.0)), (11, 9, (9.0, 0.0, 0.0))]
    campaign, _ = virtual_campaigns.virtual(seed, bad_points=bad)
    answer = explained(campaign)
    assert answer.missing == ()
    assert answer.moves == ()
    assert answer.steps == ()
    assert answer.comparison.verdict is Verdict.EXPLAINED
    told = {(point.run, point.sequence): point for point in answer.suspect}
    assert set(told) == {(3, 9), (3, 40), (11, 9)}
    for run, sequence, off in bad:
        axis = int(np.abs(off).argmax())
        assert told[run, sequence].axis == "xyz"[axis]
        assert told[run, sequence].size * 1e3 == pytest.approx(off[axis], abs=5.0)


@pytest.mark.slow
def test_a_bad_point_does_not_hide_an_effect(virtual_campaigns, explained):
    sim = simulator()
    effect, bad = sim.Effect("EYX:poly2", peak_um=6.0), (5, 20, (80.0, 0.0, 0.0))
    campaign, _ = virtual_campaigns.virtual(4, [effect], bad_points=[bad], days=2)
    answer = explained(campaign)
    assert [one.effect for one in answer.missing] == ["EYX:poly2"]
    (point,) = answer.suspect
    assert (point.run, point.sequence, point.axis) == (5, 20, "x")
    assert point.size * 1e3 == pytest.approx(80.0, abs=5.0)


@pytest.mark.all_seeds
def test_a_noisier_run_has_no_bad_points_for_that(virtual_campaigns, explained):
    campaign, told = virtual_campaigns.virtual(6)
    rng = np.random.default_rng(6)
    for axis in "XYZ":
        readings = campaign.probings.readings[axis]
        readings[told["run"] == 7] += 2e-3 * rng.standard_normal(62)
    answer = explained(campaign)
    assert answer.suspect == ()
    assert answer.scatter == ()
    assert answer.moves == ()
    assert answer.missing == ()


def test_a_ball_that_moved_between_runs_is_a_step_of_that_ball_alone(virtual_campaigns, explained):
    sim = simulator()
    loose = sim.Effect("ball:4:moved", coefficients=(0.004, -0.007, 0.003), at=(9, 1))
    answer = explained(virtual_campaigns.virtual(5, [loose])[0])
    (step,) = answer.steps
    assert (step.parameter, step.target, step.run) == (None, "4", 9)
    assert step.size == pytest.approx(-0.007, abs=1.5e-3)
    assert answer.missing == ()
    assert answer.moves == ()


@pytest.mark.slow
def test_an_effect_that_varies_from_run_to_run_is_said_to_vary(virtual_campaigns, explained):
    """No recorded column follows it, and no bad points or moved balls are invented."""
    sim = simulator()
    sizes = np.random.default_rng(3).standard_normal(12)
    sizes *= 2e-7 / np.std(sizes, ddof=1)
    answer = explained(virtual_campaigns.virtual(3, [sim.Effect("EAX:poly1", coefficients=sizes)], days=3)[0])
    (found,) = answer.missing
    assert found.effect == "EAX:poly1@each_run"
    assert found.varies
    assert found.held_out_after is None
    assert abs(found.amplitude - 2e-7) < 3 * found.u
    assert "not recorded" in found.description.cause
    assert answer.suspect == ()
    assert answer.scatter == ()
    assert answer.moves == ()
    assert answer.comparison.verdict is Verdict.SOMETHING_IS_MISSING


@pytest.mark.slow
def test_what_a_recorded_column_follows_is_not_said_to_vary(virtual_campaigns, explained):
    sim = simulator()
    campaign, _ = virtual_campaigns.virtual(3, [sim.Effect("EAX:poly1@x_axis_degC", peak_um=8.0)])
    (found,) = explained(campaign).missing
    assert found.effect == "EAX:poly1@x_axis_degC"
    assert not found.varies
