"""Ball bars in several planes of one run: simulated by the distance of two points, without a line of the package."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.discovery import explain, fit
from monitor.methods import campaign_method
from monitor.methods.instruments.assembly import between_set_ups
from monitor.readers import read_campaign
from monitor.workflow.instruments.too_well import read_too_well
from tests.simulator.instruments import WAYS, SimulatedAxis, SimulatedChain

CENTRE, LENGTH = np.array([200.0, 150.0, 300.0]), 100.0
BAR = """
[[setups]]
id = "bar-{plane}"
reading = "distance"
instrument = "ball bar"
standard_uncertainty_um = 0.3
tool_point_mm = [0.0, 0.0, 0.0]
work_point_mm = [200.0, 150.0, 300.0]
length_mm = 100.0
length_standard_uncertainty_um = 0.3
"""


def ball_bars(folder, error_um, degrees=(0.0, 360.0), seed=4, *, planes=("xy", "yz"), in_mm=()):
    """The campaign of a bar there and back in every plane, brought into each along its circle; ``error_um`` of
    position, last move and direction of every axis is a displacement. The planes ``in_mm`` were written in mm."""
    rng = np.random.default_rng(seed)
    rows = []
    for plane in planes:
        first, second = ("xyz".index(letter) for letter in plane)
        for sense in (1.0, -1.0):
            angles = np.arange(*degrees, 5.0)[:: int(sense)]
            way = np.radians([angles[0] - 10.0 * sense, angles[0] - 5.0 * sense, *angles])
            places = np.tile(CENTRE, (len(way), 1))
            places[:, first] += LENGTH * np.cos(way)
            places[:, second] += LENGTH * np.sin(way)
            direction = np.zeros(3)
            for index in range(1, len(way)):
                move = places[index] - places[index - 1]
                direction = np.where(np.abs(move) > 1e-6, np.sign(move), direction)
                # Nobody knows how a place was come to that was left and is read again.
                if index > (1 if sense > 0.0 else 2):
                    moved = places[index] + 1e-3 * np.asarray(error_um(places[index], move, direction))
                    reading = 1e3 * (np.linalg.norm(moved - CENTRE) - LENGTH) + rng.normal(0.0, 0.3)
                    x, y, z = places[index].round(4).tolist()
                    scale = 1e-3 if plane in in_mm else 1.0
                    rows.append(
                        {"run": 1, "setup": f"bar-{plane}", "X": x, "Y": y, "Z": z}
                        | {"reading_um": reading * scale}
                    )
    chain = SimulatedChain(tuple(SimulatedAxis(name, "linear", way) for name, way in WAYS.items()))
    setups = "".join(BAR.format(plane=plane) for plane in planes)
    return read_campaign(chain.write(folder / "bars", setups, rows, started=["2026-03-02T20:00:00+00:00"]))


def named(campaign):
    """The effects that a search names, the first first."""
    problem = campaign_method(campaign).problem_of(campaign).for_search()
    answer = explain(campaign, problem, "instruments", rng=np.random.default_rng(1))
    return {each.effect: each.amplitude for each in answer.missing}


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
    np.testing.assert_array_equal(between_set_ups(context, by_turns), 0)
    blocks = np.repeat([0, 1, 2], [100, 100, 86])
    np.testing.assert_array_equal(between_set_ups(context, blocks), blocks)
    np.testing.assert_array_equal(between_set_ups(context, np.where(blocks == 2, 0, blocks)), 0)


def test_a_play_and_a_lag_are_told_across_the_planes(tmp_path):
    """Half a reversal value of 2 um, and 0.5 um for a millimetre of the last move, as ISO 230-4's bars see them."""

    def error(place, move, direction):
        return 0.0, -2.0 * direction[1] - 0.5 * move[1], 0.0

    effects = named(ball_bars(tmp_path, error))
    assert effects.keys() == {"EYY:reversal", "EYY:lag"}
    assert effects["EYY:reversal"] == pytest.approx(-2e-3, abs=3e-4)
    assert effects["EYY:lag"] == pytest.approx(-0.5e-3, abs=6e-5)


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
