"""A robot does not come back to a pose exactly: what reflectors of a pose share is no evidence for an effect."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from by_path import simulator

from monitor.discovery import Explanation, explain, fit
from monitor.discovery.machine.evidence.poses import poses_of_rows, widening
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.variants import variants_of
from monitor.effects import parse_effect
from monitor.exceptions import DataError
from monitor.methods.tracker.method import METHOD as tracker
from monitor.readers import read_campaign
from monitor.readers.row_places import RowPlaces
from monitor.records import Campaign
from monitor.workflow.identify.notes import note


@pytest.fixture(scope="module")
def robots() -> ModuleType:
    """The simulator of tracked robots, loaded by path."""
    simulator()
    return importlib.import_module("simulator.robot_campaign")


def campaign(robots: ModuleType, folder: Path, seed: int, hidden: Any = None, **options: Any) -> Campaign:
    made = robots.track(np.random.default_rng(seed), hidden, **options)
    found = read_campaign(robots.write_tracked(folder / f"robot-{seed}", made))
    assert isinstance(found, Campaign)
    return found


def told(found: Campaign) -> Explanation:
    return explain(found, tracker.problem_of(found), "tracker", rng=np.random.default_rng(1))


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.slow
def test_joints_that_come_to_rest_elsewhere_are_no_effect(robots, tmp_path, seed):
    """40 µrad in every joint, 20 to 40 µm at the tool; counted by readings each of these had six false effects."""
    found = told(campaign(robots, tmp_path, seed, poses=250, repeatability_urad=40.0))
    assert found.missing == ()


def test_effects_are_found_through_it_and_their_uncertainty_allows_for_it(robots, tmp_path):
    hidden = robots.Hidden(compliance={"J2": 2e-4}, harmonic={"J4": (2, 2e-4, 0.7)})
    found = told(campaign(robots, tmp_path, 3, hidden, poses=250, repeatability_urad=40.0))
    by_name = {name: one for one in found.missing for name in (one.effect, *(r.effect for r in one.rivals))}
    assert len(found.missing) == 2
    assert {"EBJ2:compliance@gravity", "EAJ4:harmonic2"} <= set(by_name)
    assert abs(by_name["EAJ4:harmonic2"].amplitude - 2e-4) < 4.0 * by_name["EAJ4:harmonic2"].u


@pytest.mark.parametrize(("repeatability", "low", "high"), [(0.0, 1.0, 1.3), (40.0, 1.3, 3.1)])
def test_uncertainty_is_wider_where_poses_share_something(robots, tmp_path, repeatability, low, high):
    """At most by the square root of the nine coordinates of a pose, and not where readings are independent."""
    found = campaign(robots, tmp_path, 5, poses=300, repeatability_urad=repeatability)
    now = fit(tracker.problem_of(found))
    poses = poses_of_rows(now)
    assert poses is not None
    chain = now.problem.context.chain
    texts = ("EBJ2:compliance@gravity", "ECJ1:lag", "EBJ3:harmonic1")
    visible = scene_of(now, [variants_of(parse_effect(text, chain))[0] for text in texts])
    factors = [float(widening(visible, [one], poses).max()) for one in visible.candidates]
    assert low <= float(np.median(factors)) <= high


def test_readings_that_do_not_share_a_pose_are_counted_as_they_are(robots, tmp_path):
    found = campaign(robots, tmp_path, 6, poses=60, reflectors=("R1",))
    assert poses_of_rows(fit(tracker.problem_of(found))) is None


def edited(robots: ModuleType, folder: Path, old: str, new: str) -> Campaign:
    path = robots.write_tracked(folder / "robot", robots.track(np.random.default_rng(7), poses=60))
    text = (path / "campaign.toml").read_text()
    assert old in text
    (path / "campaign.toml").write_text(text.replace(old, new, 1))
    found = read_campaign(path)
    assert isinstance(found, Campaign)
    return found


def test_a_link_typed_ten_times_too_short_is_told(robots, tmp_path):
    found = edited(robots, tmp_path, "455.0", "45.5")
    identified = tracker.identify(found)
    words = note(found.machine, identified, identified.runs[0], RowPlaces(found))
    assert "EZ0J3 comes to 40" in words
    assert "puts J3 45.5 mm from the axis before it" in words
    assert "check offset_mm of J3" in words


def test_a_joint_whose_zero_is_off_by_seven_degrees_is_told(robots, tmp_path):
    location = robots.errors_of_robot(np.random.default_rng(8))
    location["J3"][4] += np.deg2rad(7.0)
    found = campaign(robots, tmp_path, 8, poses=60, location=location)
    identified = tracker.identify(found)
    words = note(found.machine, identified, identified.runs[0], RowPlaces(found))
    assert "EB0J3 comes to 7" in words
    assert "check the zero, the direction and the sign of J3" in words


def test_nothing_is_noted_of_a_robot_as_it_is(robots, tmp_path):
    found = campaign(robots, tmp_path, 9, poses=60)
    identified = tracker.identify(found)
    assert note(found.machine, identified, identified.runs[0], RowPlaces(found)) == ""


def test_points_in_metres_are_refused(robots, tmp_path):
    made = robots.track(np.random.default_rng(10), poses=40)
    made = type(made)(made.target, made.readings, made.points / 1e3, made.location)
    found = read_campaign(robots.write_tracked(tmp_path / "robot", made))
    with pytest.raises(DataError, match=r"1e\+03 times as large .* check the units of the tracker's columns"):
        tracker.problem_of(found)


def test_points_in_another_order_than_the_joints_are_not_put_down_to_a_unit(robots, tmp_path):
    """A chain shrunk to nothing follows them best: 0.02 is no ratio of two units."""
    made = robots.track(np.random.default_rng(12), poses=80)
    # Every reflector keeps its own points; only the poses are another's.
    shuffled = made.points.copy()
    for name in np.unique(made.target):
        rows = np.flatnonzero(np.array(made.target) == name)
        shuffled[rows] = made.points[np.random.default_rng(13).permutation(rows)]
    made = type(made)(made.target, made.readings, shuffled, made.location)
    found = read_campaign(robots.write_tracked(tmp_path / "robot", made))
    with pytest.raises(DataError, match="do not belong together row by row: in no frame and at no size"):
        tracker.problem_of(found)


@pytest.mark.parametrize(("factor", "told"), [(25.4, "25.[0-9]"), (0.1, "0.(1|09..)"), (100.0, "(100|99..)")])
def test_points_in_any_unit_are_told_as_a_unit(robots, tmp_path, factor, told):
    made = robots.track(np.random.default_rng(14), poses=40)
    made = type(made)(made.target, made.readings, made.points / factor, made.location)
    found = read_campaign(robots.write_tracked(tmp_path / "robot", made))
    with pytest.raises(
        DataError, match=rf"{told} times as large .* check the units of the tracker's columns"
    ):
        tracker.problem_of(found)


def test_rows_that_are_there_twice_are_refused(robots, tmp_path):
    made = robots.track(np.random.default_rng(11), poses=40)
    made = type(made)(
        list(np.repeat(made.target, 2)),
        np.repeat(made.readings, 2, 0),
        np.repeat(made.points, 2, 0),
        made.location,
    )
    found = read_campaign(robots.write_tracked(tmp_path / "robot", made))
    with pytest.raises(
        DataError, match=r"120 of 240 rows .* repeat another row of the same run to the last digit"
    ):
        tracker.problem_of(found)
