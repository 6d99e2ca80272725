"""Angles that begin anew at the end of a column, and those that only look like it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.readers import read_campaign
from monitor.readers.doubts.angle_doubts import angles_begun_anew
from monitor.records import Array, Campaign

MOUNT = Path(__file__).parents[2] / "examples" / "mount-gem-28"


@pytest.fixture(scope="module")
def mount() -> Campaign:
    campaign = read_campaign(MOUNT)
    assert isinstance(campaign, Campaign)
    return campaign


def told(mount: Campaign, degrees: Array) -> list[str]:
    """What is said of a mount whose one axis stood at angles in degrees."""
    rows = mount.probings.rows(np.arange(len(degrees)))
    return list(
        angles_begun_anew(replace(mount, probings=replace(rows, readings={"DEC": np.deg2rad(degrees)})))
    )


def passes(end: float, positions: int, count: int) -> Array:
    """Passes from minus to plus ``end``, all in one direction."""
    return np.tile(np.linspace(-end, end, positions), count)


@pytest.mark.parametrize(("end", "positions"), [(170.0, 5), (170.0, 6), (175.0, 5), (170.0, 35)])
@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_passes_that_turn_back_at_once_begin_nothing_anew(
    mount: Campaign, end: float, positions: int, count: int
) -> None:
    """Was: "add 360 to those below ...", of -170, -85, 0, 85, 170 three times."""
    assert told(mount, passes(end, positions, count)) == []


@pytest.mark.parametrize("poses", [5, 6, 8, 12, 20, 40])
def test_poses_in_any_order_are_hardly_ever_said_to_begin_anew(mount: Campaign, poses: int) -> None:
    """Was: up to a fifth of robots' plans; of 1000 plans at most 11 are left, of five poses."""
    plans = [np.random.default_rng(seed).uniform(-175.0, 175.0, poses) for seed in range(200)]
    assert sum(bool(told(mount, plan)) for plan in plans) <= 5


@pytest.mark.parametrize("went", [(90, 270, 15), (0, 270, 15), (100, 200, 20)])
@pytest.mark.parametrize("count", [1, 2, 5])
@pytest.mark.parametrize("returns", [False, True])
def test_scans_past_180_degrees_are_named_however_often(
    mount: Campaign, went: tuple[int, int, int], count: int, returns: bool
) -> None:
    scan = np.arange(went[0], went[1] + 1, went[2])
    scan = np.tile(np.concatenate([scan, scan[::-1]]) if returns else scan, count)
    (sentence,) = told(mount, (scan + 180.0) % 360.0 - 180.0)
    assert f"its angles span {went[1] - went[0]} degrees" in sentence
