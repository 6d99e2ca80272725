"""A piece that slips on the table in the middle of a run: named, with where and by how much, and no effect beside it.

Rotary probing and SAMBA by tests/simulator; the slip itself is done to the touched places here, by hand.
"""

from __future__ import annotations

import numpy as np
import pytest
from by_path import simulator

from monitor.discovery import explain
from monitor.methods.samba.method import problem_of


def slipped(virtual_campaigns, seed, days, each, shift, turn=0.0, at=0.6, **options):
    """A campaign of touched balls whose plate slips by ``shift`` µm and turns about its middle by ``turn`` µrad, from
    the given part of the first run on; and the sequence number where it does."""
    sim = simulator()
    first = int(at * 62)
    balls = sim.five_days_plan().balls
    middle = np.mean([np.array(place) for place in balls.values()], axis=0)
    effects = []
    for name, place in balls.items():
        arm = np.array(place) - middle
        moved = 1e-3 * np.array(shift) + 1e-6 * turn * np.array([-arm[1], arm[0], 0.0])
        effects.append(sim.Effect(f"ball:{name}:moved", coefficients=tuple(moved), at=(1, first)))
    campaign, _ = virtual_campaigns.virtual(seed, effects, days=days, runs_per_day=each, **options)
    return campaign, first


@pytest.mark.parametrize(
    ("seed", "days", "each", "turn"),
    [
        (7102, 1, 1, 50.0),
        *(
            pytest.param(*layout, marks=pytest.mark.slow)
            for layout in ((7101, 1, 1, 0.0), (7103, 1, 2, 30.0), (7104, 2, 2, 0.0))
        ),
    ],
)
def test_a_piece_that_slips_in_a_run_is_named_alone(virtual_campaigns, seed, days, each, turn):
    shift = (7.0, -6.0, 4.0)
    campaign, first = slipped(virtual_campaigns, seed, days, each, shift, turn)
    answer = explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(1))
    assert not answer.missing
    (move,) = answer.moves
    assert move.of_all
    assert move.run == 1
    assert abs(move.sequence - first) <= 2
    # 1 µm a touch, some 25 touches after it and 37 before: 0.26 µm; three and a half of them.
    np.testing.assert_allclose(1e3 * np.array(move.shift), shift, rtol=0, atol=0.9)


def test_one_ball_that_comes_loose_is_no_slip_of_the_piece(virtual_campaigns):
    loose = simulator().Effect("ball:2:moved", coefficients=(0.012, -0.008, 0.005), at=(1, 30))
    campaign, _ = virtual_campaigns.virtual(7105, [loose], days=1, runs_per_day=2)
    answer = explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(1))
    assert [(move.target, move.of_all) for move in answer.moves] == [("2", False)]


@pytest.mark.parametrize(
    "effect",
    [
        "EX0C@run_time",
        "EZC1:const@warmup",
        pytest.param("EXX:poly1@warmup", marks=pytest.mark.all_seeds),
    ],
)
@pytest.mark.slow
def test_a_drift_of_the_machine_is_no_slip(virtual_campaigns, effect):
    options = {"tau_s": 900.0} if "warmup" in effect else {}
    drift = simulator().Effect(effect, peak_um=10.0, **options)
    campaign, _ = virtual_campaigns.virtual(7106, [drift], days=1, runs_per_day=1)
    answer = explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(1))
    assert not answer.moves
