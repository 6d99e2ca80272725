"""Poses that tell a group apart: a simulation with them added shows that they do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from by_path import simulator


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
