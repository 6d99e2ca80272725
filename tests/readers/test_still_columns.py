"""Columns that stand still while the readings say that the axis moved are told; axes that are kept still are not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import find_still_axes
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.readers import read_campaign
from monitor.readers.doubts.still_columns import still_columns
from monitor.records import Campaign
from tests.simulator.ball_plate import plate_rows, write_plate

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def _read(folder: Path) -> Campaign:
    campaign = read_campaign(folder)
    assert isinstance(campaign, Campaign)
    return campaign


def _still(campaign: Campaign, *axes: str) -> Campaign:
    probings = campaign.probings
    readings = {
        axis: np.full_like(values, values[0]) if axis in axes else values
        for axis, values in probings.readings.items()
    }
    return replace(campaign, probings=replace(probings, readings=readings))


def _problem_of(campaign: Campaign) -> ChainProblem:
    method = campaign_method(campaign)
    return method.problem_of(campaign, method.own_model)


@pytest.mark.parametrize(("axis", "setup"), [("X", "place1"), ("Z", "place3")])
def test_a_plate_shows_the_axis_that_its_column_does_not(tmp_path: Path, axis: str, setup: str) -> None:
    campaign = _read(write_plate(tmp_path / "plate", plate_rows(5)))
    assert list(still_columns(campaign)) == []
    (sentence,) = still_columns(_still(campaign, axis))
    assert sentence.startswith(f"column {axis.lower()}_mm stands still in all rows")
    assert f"setup {setup} lie further apart" in sentence
    assert "moved over 40" in sentence


def test_a_plate_that_lies_in_the_plane_of_the_others_says_nothing_of_an_axis(tmp_path: Path) -> None:
    campaign = _read(write_plate(tmp_path / "plate", plate_rows(5)))
    lying = campaign.probings.rows(campaign.probings.channels["setup"] <= 2)
    assert list(still_columns(_still(replace(campaign, probings=lying), "Z"))) == []


def test_readings_that_differ_where_no_axis_moves_are_told() -> None:
    campaign = _read(EXAMPLES / "r-test")
    assert list(still_columns(campaign)) == []
    (sentence,) = still_columns(_still(campaign, *campaign.probings.readings))
    assert "stand still in all rows, and what setup r-test read scatters" in sentence


def test_axes_that_are_kept_still_are_not_told() -> None:
    campaign = _read(EXAMPLES / "laser")
    along_x = replace(campaign, probings=campaign.probings.rows(campaign.probings.channels["setup"] == 1))
    assert np.ptp(along_x.probings.readings["Y"]) == 0.0
    assert list(still_columns(along_x)) == []


@pytest.mark.slow
@pytest.mark.parametrize("axis", ["J3", "J5"])
def test_a_joint_that_moved_unseen_is_told_by_the_points_of_a_tracker(axis: str) -> None:
    campaign = _read(EXAMPLES / "tracked-robot")
    campaign = replace(campaign, probings=campaign.probings.rows(np.arange(100)))
    (mistake,) = find_still_axes(_still(campaign, axis), _problem_of)
    assert mistake.what.startswith(f"{axis.lower()}_deg stood still in all rows while {axis} moved")
    assert find_still_axes(campaign, _problem_of) == ()
