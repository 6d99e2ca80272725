"""A pass of a ball bar whose readings stand in the opposite order, and one bar with another sign, beside plays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from monitor.discovery import find_setup_mistakes, find_turned_passes, fit
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Campaign
from tests.discovery.ball_bars import CENTRE, ball_bars

PLANES = ("xy", "yz", "zx")


def _problem_of(campaign: Campaign) -> ChainProblem:
    method = campaign_method(campaign)
    return method.problem_of(campaign, method.own_model)


def _with_play(place, move, way):
    """A play of X beside a squareness, gains and a centre that lies elsewhere."""
    x, y, z = place - CENTRE
    return 12.0 + 0.02 * x - 2.0 * way[0] + 0.02 * y, -9.0 - 0.015 * y, 7.0 + 0.01 * z


def _read(campaign: Campaign, change) -> Campaign:
    """The campaign with other readings."""
    reading = campaign.probings.channels["reading_um"].copy()
    change(reading)
    channels = {**campaign.probings.channels, "reading_um": reading}
    return replace(campaign, probings=replace(campaign.probings, channels=channels))


@pytest.fixture(scope="module")
def right(tmp_path_factory):
    return ball_bars(tmp_path_factory.mktemp("bars"), _with_play, planes=PLANES)


def test_a_circle_that_was_read_the_other_way_round_is_told(right):
    def turn(reading):
        reading[72:143] = reading[72:143][::-1]

    campaign = _read(right, turn)
    mistakes = find_turned_passes(campaign, _problem_of, fit(_problem_of(campaign)))
    assert [each.what for each in mistakes] == [
        "the readings of sequence 73 to 143 of run 1 (setup bar-xy) stood in the opposite order beside their "
        "positions"
    ]
    assert mistakes[0].rms_undone < 0.5 * mistakes[0].rms_as_recorded


@pytest.mark.slow
def test_two_circles_are_told_together(right):
    def turn(reading):
        reading[72:143] = reading[72:143][::-1]
        reading[215:286] = reading[215:286][::-1]

    campaign = _read(right, turn)
    (mistake,) = find_turned_passes(campaign, _problem_of, fit(_problem_of(campaign)))
    assert "sequence 73 to 143 of run 1 (setup bar-xy)" in mistake.what
    assert "sequence 216 to 286 of run 1 (setup bar-yz)" in mistake.what


def test_a_bar_with_another_sign_is_told_beside_a_play(right):
    campaign = _read(right, lambda reading: np.negative(reading[286:], out=reading[286:]))
    (mistake,) = find_setup_mistakes(campaign, _problem_of, fit(_problem_of(campaign)))
    assert mistake.what == (
        "the sign of reading_um were the other way round in setup bar-zx (with EXX:reversal in the model)"
    )
    assert mistake.rms_undone < 3.5e-4 < 2.0 * mistake.rms_undone < mistake.rms_as_recorded


@pytest.mark.slow
def test_a_play_is_neither(right):
    first = fit(_problem_of(right))
    assert find_turned_passes(right, _problem_of, first) == ()
    assert find_setup_mistakes(right, _problem_of, first) == ()
