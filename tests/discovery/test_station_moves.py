"""A station that moved once within a run: when, and whether it was the tracker or the robot.

The simulator shares no code with the package; rates: ``tests/benchmarks/trial_station_moves.py``.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import Explanation, explain
from monitor.effects import parse_effect
from monitor.exceptions import EffectError
from monitor.methods.tracker.method import METHOD
from monitor.readers import read_campaign
from tests.simulator import robot_campaign as robots

#: The first reading after the move, counted from 1.
MOMENT = 201


def explained(folder: Path, shifts: np.ndarray, what: str, fixed_every: int = 10) -> Explanation:
    """What is told of a robot of which all points, or those that it carries, are seen elsewhere by (n, 3) mm."""
    rng = np.random.default_rng([4, 29])
    track = robots.track(rng, poses=100, fixed_every=fixed_every)
    takes_part = (what == "tracker") | ~np.isin(track.target, list(robots.FIXED))
    points = track.points + takes_part[:, None] * shifts[: len(track.points)]
    campaign = read_campaign(
        robots.write_tracked(folder / "robot", replace(track, points=np.round(points, 5)))
    )
    return explain(campaign, METHOD.problem_of(campaign), "tracker", rng=np.random.default_rng(1))


def at_once(size_mm: float) -> np.ndarray:
    """A shift from a moment on."""
    after = np.arange(1, 401) >= MOMENT
    return np.outer(after, size_mm * np.array([0.6, -0.48, 0.64]))


@pytest.mark.parametrize("what", ["tracker", "base"])
@pytest.mark.slow
def test_a_station_that_moved_once_is_named_with_its_moment(tmp_path: Path, what: str) -> None:
    """Was `tracker:shift@run_time`, or several drifts of the base of the robot."""
    (found,) = explained(tmp_path, at_once(0.1), what).missing
    head, _, moment = found.effect.partition(":moved(run 1, sequence ")
    assert head == what
    assert abs(int(moment.rstrip(")")) - MOMENT) <= 3


def test_without_resting_reflectors_tracker_and_robot_are_one(tmp_path: Path) -> None:
    (found,) = explained(tmp_path, at_once(0.1), "tracker", fixed_every=0).missing
    assert found.effect.startswith("tracker:moved(")
    assert [rival.effect.partition("(")[0] for rival in found.rivals if rival.coincides] == ["base:moved"]


@pytest.mark.parametrize("what", ["tracker", "base"])
def test_what_settles_within_some_poses_is_no_move(tmp_path: Path, what: str) -> None:
    """By 0.1 mm with a twentieth of the run: a base was told as moved in 8 of 20 where only drifts of the
    catalogue were rivals."""
    settled = 1.0 - np.exp(-np.arange(400) / 17.0)
    told = explained(tmp_path, np.outer(settled, [0.06, -0.048, 0.064]), what)
    assert not any(":moved" in found.effect for found in told.missing)


def test_a_move_says_when(tmp_path: Path) -> None:
    campaign = read_campaign(
        robots.write_tracked(tmp_path / "robot", robots.track(np.random.default_rng(1), poses=30))
    )
    context = METHOD.problem_of(campaign).context
    with pytest.raises(EffectError, match=r"'tracker:moved' must say when"):
        parse_effect("tracker:moved", context.chain)
    with pytest.raises(EffectError, match="this campaign has no run 7"):
        parse_effect("base:moved(run 7, sequence 3)", context.chain).basis(context)


@pytest.mark.slow
def test_a_tracker_that_walks_through_two_runs_is_no_move(tmp_path: Path) -> None:
    """At the price of ten nodes a run a walk was never worth it, and was told as a move."""
    rng = np.random.default_rng(0)
    track = robots.track(np.random.default_rng([4, 29]), poses=200, fixed_every=10, noise_um=0.0)
    count = len(track.points)
    seen = 0.016 * rng.normal(size=(count, 3)) + np.cumsum(0.0015 * rng.normal(size=(count, 3)), axis=0)
    folder = robots.write_tracked(tmp_path / "robot", replace(track, points=np.round(track.points + seen, 5)))
    lines = (folder / "probings.csv").read_text().splitlines()
    later = [f"2,{row + 1}," + line.split(",", 2)[2] for row, line in enumerate(lines[count // 2 + 1 :])]
    (folder / "probings.csv").write_text("\n".join([*lines[: count // 2 + 1], *later]) + "\n")
    with (folder / "runs.csv").open("a") as runs:
        runs.write("2,2026-03-02T12:30:00+01:00,1,false,21.3\n")
    campaign = read_campaign(folder)
    told = explain(campaign, METHOD.problem_of(campaign), "tracker", rng=np.random.default_rng(1))
    assert not any(":moved" in found.effect for found in told.missing)
