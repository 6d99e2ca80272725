"""Hidden effects of an exact robot, one, two and three at once, found from outside; what one run cannot decide.

A few seeds at a third of the usual size; rates over many at full size are in ``tests/benchmarks/trial_robots.py``.
"""

from __future__ import annotations

import importlib
import importlib.util
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from monitor.discovery import Explanation, Verdict, explain, fit
from monitor.discovery.machine.evidence.held_out import pose_parts
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.version_error import version_error
from monitor.methods.model import Model
from monitor.methods.tracker.method import METHOD as tracker
from monitor.readers import read_campaign


@pytest.fixture(scope="module")
def robots(simulator: ModuleType) -> ModuleType:
    """The simulator of tracked robots."""
    return importlib.import_module(f"{simulator.__name__}.robot_campaign")


def explained(robots: ModuleType, folder: Path, seed: int, hidden: Any, **options: Any) -> Explanation:
    made = robots.track(np.random.default_rng(seed), hidden, poses=options.pop("poses", 300), **options)
    campaign = read_campaign(robots.write_tracked(folder / f"robot-{seed}", made))
    return explain(campaign, tracker.problem_of(campaign), "tracker", rng=np.random.default_rng(1))


def names(told: Explanation) -> list[set[str]]:
    """For every finding the effect and those that the data do not rule out."""
    return [{one.effect, *(rival.effect for rival in one.rivals)} for one in told.missing]


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.all_seeds)])
def test_nothing_is_missing_where_nothing_is_hidden(robots, tmp_path, seed):
    told = explained(robots, tmp_path, seed, robots.Hidden(), fixed_every=30)
    assert told.missing == ()
    assert told.suspect == ()
    assert told.comparison.verdict is Verdict.EXPLAINED


@pytest.mark.parametrize("seed", [3, pytest.param(4, marks=pytest.mark.all_seeds)])
def test_one_joint_that_gives_way(robots, tmp_path, seed):
    told = explained(robots, tmp_path, seed, robots.Hidden(compliance={"J2": 2e-4}))
    (found,) = told.missing
    assert any("EBJ2:compliance@gravity" in group for group in names(told))
    if found.effect == "EBJ2:compliance@gravity":
        assert abs(found.amplitude - 2e-7) < 5.0 * found.u
    assert found.rms_after < 0.021
    assert found.held_out_before is not None
    assert found.held_out_after is not None
    # Readings that were left out are predicted to their noise, and were not before.
    assert found.held_out_after < 0.022 < found.held_out_before


@pytest.mark.slow
@pytest.mark.parametrize("loads", [(2e-4, 6e-4), (3e-4, 3e-4)])
def test_a_payload_that_was_changed_between_two_runs(robots, tmp_path, loads):
    """Nothing was told: one size of both predicts either run by the other badly. Of one load it is no rival."""
    location = robots.errors_of_robot(np.random.default_rng(60))
    rows: list[str] = []
    for run, load in enumerate(loads, 1):
        hidden = robots.Hidden(compliance={"J2": load})
        made = robots.track(np.random.default_rng([61, run]), hidden, poses=100, location=location)
        folder = robots.write_tracked(tmp_path / f"robot-{run}", made)
        header, *of_run = (folder / "probings.csv").read_text().splitlines()
        rows += [f"{run}{line[1:]}" for line in of_run]
    (folder / "probings.csv").write_text("\n".join([header, *rows]) + "\n")
    with (folder / "runs.csv").open("a") as runs:
        runs.write("2,2026-03-02T12:30:00+01:00,1,false,21.3\n")
    campaign = read_campaign(folder)
    told = explain(campaign, tracker.problem_of(campaign), "tracker", rng=np.random.default_rng(1))
    (found,) = told.missing
    changed = loads[0] != loads[1]
    assert found.effect == f"EBJ2:compliance@{'load_each_run' if changed else 'gravity'}"
    assert not any(rival.effect == "EBJ2:compliance@load_each_run" for rival in found.rivals)
    u = np.sqrt(np.diag(found.covariance))
    expected = 1e-3 * np.array(loads if changed else loads[:1])
    assert np.all(np.abs(found.coefficients - expected) < 5.0 * u)


def test_two_at_once(robots, tmp_path):
    hidden = robots.Hidden(compliance={"J2": 3e-4}, harmonic={"J3": (1, 1.5e-4, 0.7)})
    told = explained(robots, tmp_path, 5, hidden)
    groups = names(told)
    assert len(groups) == 2
    for wanted in ("EBJ2:compliance@gravity", "EBJ3:harmonic1"):
        assert any(wanted in group for group in groups)


def test_three_at_once(robots, tmp_path):
    hidden = robots.Hidden(compliance={"J2": 3e-4}, harmonic={"J4": (2, 2e-4, 0.7)}, lag={"J1": 1e-4})
    told = explained(robots, tmp_path, 6, hidden)
    groups = names(told)
    assert len(groups) == 3
    for wanted in ("EBJ2:compliance@gravity", "EAJ4:harmonic2", "ECJ1:lag"):
        assert any(wanted in group for group in groups)


def test_a_gear_of_unknown_ratio(robots, tmp_path):
    told = explained(robots, tmp_path, 7, robots.Hidden(harmonic={"J3": (121, 1e-4, 0.7)}))
    (found,) = told.missing
    assert found.effect == "EBJ3:harmonic121"
    assert found.searched is not None
    assert found.searched.name == "periods a turn"
    assert found.searched.value == pytest.approx(121.0, abs=0.2)
    assert abs(found.amplitude - 1e-4) < 5.0 * found.u


@pytest.mark.slow
def test_a_drifting_tracker_and_a_joint_with_play(robots, tmp_path):
    hidden = robots.Hidden(reversal={"J1": 8e-5}, drift_mm=(0.1, -0.2, 0.05))
    told = explained(robots, tmp_path, 8, hidden, fixed_every=15)
    groups = names(told)
    assert any("ECJ1:reversal" in group for group in groups)
    assert any(name.startswith("tracker:shift") for group in groups for name in group)


def test_blocks_of_poses_left_out_against_brute_force(robots, tmp_path):
    made = robots.track(np.random.default_rng(9), robots.Hidden(compliance={"J2": 2e-4}), poses=120)
    campaign = read_campaign(robots.write_tracked(tmp_path / "robot", made))
    problem = tracker.problem_of(campaign, Model("one", added=("EBJ2:compliance@gravity",)))
    whole = fit(problem)
    parts = pose_parts(whole)
    assert parts is not None
    rows = parts.reshape(-1, 3)[:, 0]
    assert set(rows.tolist()) == set(range(10))
    # Rows of one pose are left out together.
    poses = np.unique(np.column_stack([*campaign.probings.readings.values()]), axis=0, return_inverse=True)[1]
    assert all(len(set(rows[poses.ravel() == pose].tolist())) == 1 for pose in range(120))
    total = 0.0
    for part in range(10):
        without = fit(problem, rows == part, whole)
        total += float(np.sum((without.vectors[rows == part] / 0.02) ** 2))
    seen = scene_of(whole, [])
    fast = seen.held_out_error(seen.shared)
    assert fast == pytest.approx(0.02 * np.sqrt(total / whole.readings), rel=1e-3)
    assert version_error(whole).held_out_rms == pytest.approx(fast)


def test_few_poses_have_no_held_out_error(robots, tmp_path):
    made = robots.track(np.random.default_rng(10), poses=15)
    campaign = read_campaign(robots.write_tracked(tmp_path / "robot", made))
    assert pose_parts(fit(tracker.problem_of(campaign))) is None
