"""Rows of a laser that were approached anew, which only a play shows: simulated without a line of the package."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.effects import parse_effect
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from tests.simulator.instruments import WAYS, SimulatedAxis, SimulatedChain, laser

TARGETS = np.linspace(0.0, 500.0, 11)


def context(folder, beyond_mm, first_from_mm, play_um, seed=3, *, other_axis_mm=0.0):
    """The context of three runs there and back with both ends read twice; a play operator of its own. ``other_axis_mm``
    is the scatter of the positions of an axis that stands."""
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
                y = float(rng.normal(0.0, other_axis_mm))
                rows.append({"run": run, "setup": "laser", "X": x, "Y": y, "Z": 0.0, "reading_um": reading})
    return _context_of(folder, chain, rows)


def _context_of(folder, chain, rows):
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


def test_an_axis_that_stands_may_show_positions_that_scatter(tmp_path):
    """The third decimal of an encoder is no move."""
    travel = context(tmp_path, 5.0, 5.0, play_um=5.0, other_axis_mm=1e-3).travel[:22, 1]
    np.testing.assert_array_equal(travel, [1.0] * 11 + [-1.0] * 11)


def no_play(folder, error_um, targets=TARGETS, pause_s=0.0):
    """The context of three runs that read both ends twice, the second time after a pause; ``error_um`` is of position,
    last move and seconds."""
    rng = np.random.default_rng(5)
    chain = SimulatedChain(tuple(SimulatedAxis(name, "linear", way) for name, way in WAYS.items()))
    rows = []
    for run in (1, 2, 3):
        seconds, move, before = 0.0, 0.0, float(targets[0])
        for index, x in enumerate([*targets, *targets[::-1]]):
            seconds += 20.0 + pause_s * (index == len(targets))
            move = float(x) - before if index != len(targets) else 0.0
            before = float(x)
            reading = 1e3 * x + error_um(x, move, seconds) + rng.normal(0.0, 0.3)
            row = {"run": run, "setup": "laser", "time_s": seconds, "X": x, "Y": 0.0, "Z": 0.0}
            rows.append({**row, "reading_um": reading})
    return _context_of(folder, chain, rows)


def test_a_lag_is_not_taken_for_a_play_that_turned(tmp_path):
    """It vanishes where the axis stood; steps of several lengths tell it from a play."""
    targets = TARGETS + np.random.default_rng(1).uniform(-8.0, 8.0, len(TARGETS))
    assert no_play(tmp_path, lambda x, move, seconds: 0.1 * move, targets).approach is None


def test_what_drifted_in_a_long_pause_at_an_end_is_no_play_that_turned(tmp_path):
    """A zero that moved by 4 um while the axis stood is what the turned side of a play would be."""
    assert no_play(tmp_path, lambda x, move, seconds: 4.0 * (seconds > 500.0), pause_s=600.0).approach is None
