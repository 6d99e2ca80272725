"""Ball bars in several planes of one run."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.discovery import fit
from monitor.methods import campaign_method
from monitor.methods.instruments.assembly import set_ups
from monitor.workflow.instruments.too_well import read_too_well
from tests.discovery.ball_bars import ball_bars, named


def test_the_last_move_is_not_known_of_the_first_row_of_a_setup(tmp_path):
    context = (
        campaign_method(campaign := ball_bars(tmp_path, lambda *_: (0.0, 0.0, 0.0)))
        .problem_of(campaign)
        .context
    )
    first, second = context.stretches
    assert len(first) == len(second) == 143
    assert not context.moves[second[0]].any()
    assert context.moves[second[1]].any()


def test_setups_that_are_read_by_turns_stand_there_together(tmp_path):
    campaign = ball_bars(tmp_path, lambda *_: (0.0, 0.0, 0.0))
    context = campaign_method(campaign).problem_of(campaign).context
    by_turns = np.arange(len(context)) % 2
    np.testing.assert_array_equal(set_ups(context, by_turns), 0)
    blocks = np.repeat([0, 1, 2], [100, 100, 86])
    np.testing.assert_array_equal(set_ups(context, blocks), blocks)
    np.testing.assert_array_equal(set_ups(context, np.where(blocks == 2, 0, blocks)), 0)


def test_a_play_and_a_lag_are_told_across_the_planes(tmp_path):
    """Half a reversal value of 2 um, and 0.5 um for a millimetre of the last move, as ISO 230-4's bars see them."""

    def error(place, move, direction):
        return 0.0, -2.0 * direction[1] - 0.5 * move[1], 0.0

    effects = named(ball_bars(tmp_path, error))
    assert effects.keys() == {"EYY:reversal", "EYY:lag"}
    assert effects["EYY:reversal"] == pytest.approx(-2e-3, abs=3e-4)
    assert effects["EYY:lag"] == pytest.approx(-0.5e-3, abs=6e-5)


@pytest.mark.slow
def test_sides_of_a_play_that_have_no_solution_end_no_search(tmp_path):
    """With what the play of X does at the first rows of each plane as unknowns the fit of this campaign does not end
    (of twelve seeds one)."""

    def error(place, move, direction):
        return -2.0 * direction[0], 0.0, 0.0

    assert [*named(ball_bars(tmp_path, error, seed=2510, planes=("xy", "yz", "zx")))] == ["EXX:reversal"]


def test_a_bend_far_from_the_zero_of_its_axis_is_named(tmp_path):
    """4 um at the ends of 200 mm, in positions of 200 to 400 mm, over 220 degrees of a circle."""

    def error(place, move, direction):
        return 0.0, 4.0 * ((place[2] - 300.0) / 100.0) ** 2, 0.0

    effects = named(ball_bars(tmp_path, error, (-20.0, 201.0), planes=("yz", "xy", "zx")))
    assert [*effects] == ["EYZ:poly2"]
    assert effects["EYZ:poly2"] == pytest.approx(4e-7, rel=0.15)


@pytest.mark.parametrize(
    ("planes", "in_mm", "named_setup"),
    [(("xy", "yz"), ("yz",), "bar-yz"), (("xy", "yz"), (), None), (("yz",), ("yz",), None)],
    ids=["one of two", "none", "one alone, of which the whole residual says it"],
)
def test_a_setup_that_fits_far_too_well_is_named(tmp_path, planes, in_mm, named_setup):
    """A plane was written in mm under a heading of um."""

    def error(place, move, direction):
        return 0.0, -2.0 * direction[1], 0.0

    campaign = ball_bars(tmp_path, error, planes=planes, in_mm=in_mm)
    method = campaign_method(campaign)
    sentence = read_too_well(fit(method.problem_of(campaign)), method.instruments)
    if named_setup is None:
        assert sentence is None
    else:
        assert sentence is not None
        assert sentence.startswith(f"the readings of setup {named_setup} fit ")
