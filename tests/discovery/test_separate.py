"""Poses that tell a group apart: a simulation with them added shows that they do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from by_path import simulator

from monitor.discovery import explain, fit
from monitor.discovery.machine.separation import separate
from monitor.discovery.machine.separation.distances import Pair, distance_of, select_poses
from monitor.discovery.machine.separation.setups import of_effects, runs_that_decide, setups_of
from monitor.effects import parse_effect
from monitor.machine import parse_topology
from monitor.methods.samba.method import problem_of
from monitor.records import SecondSetup
from monitor.workflow.explain.machine_answer import machine_explanation


@pytest.fixture(scope="module")
def campaign_with(virtual_campaigns):
    """A campaign of a plan with poses added, all four balls at each."""
    sim = simulator()

    def build(plan, seed, effect, poses=(), noise_um=1.0):
        rng = np.random.default_rng(seed)
        more = [
            (ball, {name: float(np.degrees(angle)) for name, angle in pose.items()})
            for pose in poses
            for ball in "1234"
        ]
        plan = replace(plan, probings=(*plan.probings, *more))
        schedule = sim.working_days(rng, days=4, runs_per_day=3)
        machine = sim.hu40(None, [effect])
        told = sim.simulate(plan, machine, schedule, rng, noise_um=noise_um)
        return virtual_campaigns.as_campaign(plan, machine, schedule, told, stated_um=noise_um)

    return build


def names(found):
    return {found.effect, *(rival.effect for rival in found.rivals)}


@pytest.mark.slow
def test_poses_tell_the_table_from_the_pivot(virtual_campaigns, explained, campaign_with):
    """In the cold-cold plan C turns three times as far as B: run-out of C and of B coincide, until they part."""
    sim = simulator()
    plan, hidden = sim.cold_cold_plan(), sim.Effect("EXC:harmonic2", peak_um=8.0, direction=(1.0, -0.7))
    (found,) = explained(campaign_with(plan, 3, hidden)).missing
    assert {"EXC:harmonic2", "EXB:harmonic3"} <= names(found)
    assert all(rival.coincides for rival in found.rivals)
    assert found.separation.before < 1.0
    assert found.separation.after > 5.0
    assert found.separation.poses
    assert found.separation.together == ()
    (alone,) = explained(campaign_with(plan, 4, hidden, found.separation.poses)).missing
    assert names(alone) == {"EXC:harmonic2"}


@pytest.mark.slow
def test_poses_tell_harmonics_of_the_spindle_apart_where_quarters_do_not(
    virtual_campaigns, explained, campaign_with
):
    sim = simulator()
    plan, hidden = sim.five_days_plan(), sim.Effect("EXC1:harmonic1", peak_um=8.0, direction=(1.0, -0.7))
    (found,) = explained(campaign_with(plan, 3, hidden)).missing
    assert {"EXC1:harmonic1", "EXC1:harmonic3"} <= names(found)
    quarter = np.pi / 2
    assert any(pose["C1"] % quarter > 0.1 for pose in found.separation.poses)
    # Run-out seen from the spindle is the same in X and in Y a quarter of a turn later: no pose can help.
    assert any({"EXC1:harmonic1", "EYC1:harmonic1"} == set(pair) for pair in found.separation.together)
    (after,) = explained(campaign_with(plan, 4, hidden, found.separation.poses)).missing
    assert "EXC1:harmonic1" in names(after)
    assert "EXC1:harmonic3" not in names(after)


@pytest.mark.slow
def test_nothing_is_offered_where_no_pose_can(virtual_campaigns, explained, campaign_with):
    """Run-out of a table in X and in Y differ by what its location error takes up, at any pose."""
    sim = simulator()
    hidden = sim.Effect("EXB:harmonic1", peak_um=8.0, direction=(1.0, -0.7))
    (found,) = explained(campaign_with(sim.five_days_plan(), 3, hidden)).missing
    assert {"EXB:harmonic1", "EZB:harmonic1"} <= names(found)
    assert found.separation.poses == ()
    assert found.separation.together != ()


def test_nothing_is_offered_where_there_is_nothing_to_separate(virtual_campaigns, explained, campaign_with):
    sim = simulator()
    (found,) = explained(campaign_with(sim.five_days_plan(), 3, sim.Effect("EXX:poly2", peak_um=8.0))).missing
    assert found.rivals == ()
    assert found.separation.poses == ()


def test_another_stylus_is_named_where_no_pose_tells_a_tilt_from_a_shift():
    """With a tip 120 mm from the gauge a tilt of the carriage and its positioning move it alike, with one 50 mm longer
    they do not: against a least squares of both set-ups together, each with unknowns of its own."""
    rng = np.random.default_rng(5)
    direction = rng.choice([-1.0, 1.0], 40)
    own = rng.standard_normal((2, 40, 3))

    def rows(setup, length_mm):
        return np.column_stack([own[setup], direction, 40e-3 * length_mm * direction])

    def products(setup, length_mm):
        return rows(setup, length_mm).T @ rows(setup, length_mm)

    one, other, same = products(0, 120.0), products(1, 170.0), products(1, 120.0)
    assert runs_that_decide(Pair((0, 1), one, same[None]), 3, runs=4) is None
    assert runs_that_decide(Pair((0, 1), one, other[None]), 3, runs=4) == 1
    nothing = np.zeros((40, 3))
    free = np.block(
        [[own[0], nothing, direction[:, None]], [nothing, own[1], direction[:, None]]],
    )
    tilt = np.concatenate([rows(0, 120.0)[:, -1], rows(1, 170.0)[:, -1]])
    left = tilt - free @ np.linalg.lstsq(free, tilt, rcond=None)[0]
    apart = distance_of(of_effects(one, 3) + of_effects(other, 3), 4)
    assert apart == pytest.approx(2.0 * np.linalg.norm(left), rel=1e-6)


@pytest.mark.parametrize("noise", [0.6, 0.8])
def test_so_many_runs_are_asked_as_tell_apart_beside_the_present_ones(noise):
    """Against least squares of eight runs with one stylus and so many with a longer one, each with its own unknowns."""
    rng = np.random.default_rng(6)
    direction, own = rng.choice([-1.0, 1.0], 40), rng.standard_normal((40, 3))
    rows = [np.column_stack([own, direction, 8e-3 * length * direction]) / noise for length in (120.0, 170.0)]
    one, other = (each.T @ each for each in rows)
    runs = runs_that_decide(Pair((0, 1), one, other[None]), 3, runs=8)

    def apart(more):
        setups = [rows[0]] * 8 + [rows[1]] * more
        free = np.zeros((40 * len(setups), 3 * len(setups) + 1))
        for index, each in enumerate(setups):
            free[40 * index : 40 * index + 40, 3 * index : 3 * index + 3] = each[:, :3]
            free[40 * index : 40 * index + 40, -1] = each[:, 3]
        tilt = np.concatenate([each[:, 4] for each in setups])
        return np.linalg.norm(tilt - free @ np.linalg.lstsq(free, tilt, rcond=None)[0])

    assert 1 < runs < 8
    assert apart(runs - 1) < 5.0 <= apart(runs)


def test_set_ups_move_the_tip_or_the_targets():
    chain = parse_topology("w C B X b Z Y t")
    tip = np.array([0.0, 0.0, -120.0])
    moved = {each.setup: each for each in setups_of(chain, tip)}
    assert set(moved) == set(SecondSetup)
    assert moved[SecondSetup.LONGER_STYLUS].tip == pytest.approx([0.0, 0.0, -170.0])
    places = np.array([[100.0, 0.0, 30.0]])
    assert moved[SecondSetup.TURNED].targets(places) == pytest.approx(
        np.array([[np.sqrt(0.5) * 100.0, np.sqrt(0.5) * 100.0, 30.0]])
    )
    assert moved[SecondSetup.HIGHER].targets(places) == pytest.approx(np.array([[100.0, 0.0, 80.0]]))
    assert moved[SecondSetup.HIGHER].tip == pytest.approx(tip)
    # Readings of the tip itself say nothing of the stylus' length.
    assert SecondSetup.LONGER_STYLUS not in {each.setup for each in setups_of(chain, np.zeros(3))}


@pytest.mark.slow
def test_poses_are_readings_of_the_controller(virtual_campaigns):
    """The same touches on a machine whose C counts the other way: the poses that tell rivals apart are the same ones in
    its readings. They were those of the other side."""
    hidden = [simulator().Effect("EXC:harmonic2", peak_um=8.0)]
    campaign, _ = virtual_campaigns.virtual(7100, hidden, cold=True, runs=4)
    axes = campaign.machine.axes
    probings = campaign.probings
    mirrored = replace(
        campaign,
        machine=replace(
            campaign.machine,
            axes={**axes, "C": replace(axes["C"], sign=-1, stroke=(-np.pi / 2.0, np.pi))},
        ),
        probings=replace(probings, readings={**probings.readings, "C": -probings.readings["C"]}),
    )
    campaign = replace(
        campaign,
        machine=replace(
            campaign.machine, axes={**axes, "C": replace(axes["C"], stroke=(-np.pi, np.pi / 2.0))}
        ),
    )
    poses, in_mirror = (
        machine_explanation(explain(each, problem_of(each), "samba", rng=np.random.default_rng(1)))
        .missing[0]
        .tell_apart_by
        for each in (campaign, mirrored)
    )
    assert any(pose["c_deg"] for pose in poses)
    assert [{**pose, "c_deg": -pose["c_deg"]} for pose in poses] == [dict(pose) for pose in in_mirror]


@pytest.mark.slow
def test_the_seventh_of_a_group_is_no_tie_that_poses_break(explained, campaign_with):
    """Run-out of the spindle along X and its angle are one correction at all poses of a plan; of seven rivals six were
    asked, and poses were promised for the angle."""
    sim = simulator()
    effect = sim.Effect("EXC1:harmonic1", peak_um=8.0)
    first = explained(campaign_with(sim.five_days_plan(), 7005, effect)).missing[0]
    assert "ECC1:harmonic1" in names(first)
    assert len(names(first)) > 6
    assert any(set(pair) == {"EXC1:harmonic1", "ECC1:harmonic1"} for pair in first.separation.together)


def test_a_second_set_up_that_reaches_no_pose_is_none(virtual_campaigns, monkeypatch):
    """A machine without strokes reaches a quarter more than it went; of a lifted set-up that may be no pose at all."""
    campaign = virtual_campaigns.on_machine("one rotary table", 7)[0]
    fitted = fit(problem_of(campaign))
    effects = [parse_effect(text, fitted.problem.context.chain) for text in ("EXX:reversal", "EBX:reversal")]
    monkeypatch.setattr(
        separate, "_reachable", lambda chain, positions, *_: np.zeros(len(positions), dtype=bool)
    )
    moved = next(iter(setups_of(fitted.problem.context.chain, np.zeros(3))))
    assert separate._pairs_in(moved, fitted, effects, None, np.array([1e-3]), {}) == []
    assert separate.separating_poses(fitted, effects[0], np.array([1e-3]), effects[1:]) == separate.NO_POSES


def test_no_pose_is_offered_twice_nor_one_that_the_plan_has(virtual_campaigns):
    context = problem_of(virtual_campaigns.on_machine("one rotary table", 7)[0]).context
    turning = [index for index, joint in enumerate(context.chain.joints) if joint.turns]
    measured = separate._is_measured(
        np.concatenate([context.positions[:5], context.positions[:5] + 0.1]), context
    )
    assert measured[:5].all()
    beside = np.abs(context.positions[:5, None, turning] + 0.1 - context.positions[:, turning]).max(axis=2)
    np.testing.assert_array_equal(measured[5:], beside.min(axis=1) < np.radians(0.5))
    rng = np.random.default_rng(3)
    rows = [scale * rng.standard_normal((12, 3)) for scale in (0.05, 2.0, 1.5, 1.0, 0.8)]
    pair = Pair((0, 1), rows[0].T @ rows[0], np.stack([each.T @ each for each in rows[1:]]))
    nothing = np.zeros(4, dtype=bool)
    first, *others = select_poses([pair], 1, nothing).poses
    assert first not in others
    assert first not in select_poses([pair], 1, np.arange(4) == first).poses
    assert select_poses([pair], 1, ~nothing).poses == ()
