"""Rows of a laser that were approached anew, which only a play shows: simulated without a line of the package."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.effects import parse_effect
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from tests.simulator.instruments import WAYS, SimulatedAxis, SimulatedChain, laser

TARGETS = np.linspace(0.0, 500.0, 11)


def context(folder, beyond_mm, first_from_mm, play_um, seed=3):
    """The context of three runs there and back with both ends read twice; a play operator of its own."""
    rng = np.random.default_rng(seed)
    chain = SimulatedChain(tuple(SimulatedAxis(name, "linear", way) for name, way in WAYS.items()))
    rows = []
    for run in (1, 2, 3):
        way = [(-first_from_mm, False)] if first_from_mm else []
        way += [(float(x), True) for x in TARGETS]
        way += [(500.0 + beyond_mm, False)] if beyond_mm else []
        way += [(float(x), True) for x in TARGETS[::-1]]
        side, before = 1.0, 0.0
        for x, is_read in way:
            side = side if x == before else float(np.sign(x - before))
            before = x
            if is_read:
                reading = 1e3 * x - side * play_um / 2.0 + rng.normal(0.0, 0.3)
                rows.append({"run": run, "setup": "laser", "X": x, "Y": 0.0, "Z": 0.0, "reading_um": reading})
    days = [f"2026-03-0{day}T20:00:00+00:00" for day in (2, 3, 4)]
    campaign = read_campaign(chain.write(folder / "laser", laser(), rows, started=days))
    return campaign_method(campaign).problem_of(campaign).context


@pytest.mark.parametrize(
    ("beyond", "first", "first_sign", "end_sign"),
    [(5.0, 5.0, 1.0, -1.0), (5.0, 0.0, 1.0, -1.0), (0.0, 5.0, 1.0, 1.0), (0.0, 0.0, 1.0, 1.0)],
    ids=["beyond both ends", "beyond the far end", "first from below", "waits"],
)
def test_the_side_of_a_play_is_that_of_the_way_that_nobody_wrote_down(
    tmp_path, beyond, first, first_sign, end_sign
):
    """By hand: eleven targets there, the last of them twice, and back."""
    travel = context(tmp_path, beyond, first, play_um=5.0).travel[:22, 1]
    np.testing.assert_array_equal(travel, [first_sign, *[1.0] * 10, end_sign, *[-1.0] * 10])


def test_without_a_play_positions_say_the_direction(tmp_path):
    found = context(tmp_path, 5.0, 5.0, play_um=0.0)
    assert found.approach is None
    assert found.travel[0, 1] == 0.0
    assert found.travel[11, 1] == 1.0


def test_a_play_over_a_width_has_turned_over_where_a_row_was_approached_anew(tmp_path):
    found = context(tmp_path, 5.0, 5.0, play_um=5.0)
    effect = parse_effect("EXX:windup20mm", found.chain)
    np.testing.assert_allclose(effect.shape.columns(found, 1)[10:12, 0], [1.0, -1.0])
