"""Noise of robots that walks from pose to pose: its estimate, the filter, and what is told of trackers that walk.

Rates: ``tests/benchmarks/trial_tracker_walks.py``; the simulator shares no code with the package.
"""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from by_path import load

from monitor.discovery import Fit, fit
from monitor.discovery.machine.noise.correlation import Correlation
from monitor.discovery.machine.noise.rows import WITHIN_A_POSE, Rows, from_pose_to_pose
from monitor.discovery.machine.noise.whitening import Whitening
from monitor.discovery.machine.rounds import correlation_under
from monitor.methods.tracker.method import METHOD
from monitor.readers import read_campaign
from tests.simulator import robot_campaign as robots


@pytest.fixture(scope="module")
def trial() -> ModuleType:
    path = Path(__file__).resolve().parents[1] / "benchmarks" / "trial_tracker_walks.py"
    return load("trial_tracker_walks", path)


def robot_fit(folder: Path, trial: ModuleType, step_um: float, rest_urad: float = 0.0) -> Fit:
    """Two runs of 35 poses each, of poses of their own, by a tracker that walks so far from row to row; joints come to
    rest within ``rest_urad``."""
    rng = np.random.default_rng(3)
    track = robots.track(rng, poses=70, fixed_every=10, noise_um=0.0, repeatability_urad=rest_urad)
    count = len(track.points)
    seen = track.points + trial.NOISE_MM * rng.normal(size=(count, 3))
    seen += np.cumsum(1e-3 * step_um * rng.normal(size=(count, 3)), axis=0)
    first = np.repeat([0, count // 2], count // 2)
    made = robots.Tracked(track.target, track.readings, np.round(seen, 5), track.location)
    return fit(METHOD.problem_of(read_campaign(trial.write(folder / "robot", made, first))).for_search())


def test_a_walk_is_estimated_where_no_pose_comes_twice(tmp_path: Path, trial: ModuleType) -> None:
    """What the runs share was taken for their effects: of runs that share no pose nothing was left as noise."""
    walked = robot_fit(tmp_path, trial, 2.0)
    correlation = walked.correlation()
    assert correlation is not None
    assert correlation.rho >= 0.87
    # The variance that the walk gains from pose to pose: some 70 poses determine it within a factor of three.
    gained = 2.0 * correlation.share * (1.0 - correlation.rho) / (1.0 - correlation.share)
    expected = 3.2 * (2.0 / 16.0) ** 2
    assert expected / 3.0 < gained < 3.0 * expected
    assert correlation_under(walked) == correlation


def test_how_joints_come_to_rest_is_no_walk(tmp_path: Path, trial: ModuleType) -> None:
    """What the readings of a pose share and the next pose does not is left to the poses."""
    rests = robot_fit(tmp_path, trial, 0.0, rest_urad=40.0)
    correlation = rests.correlation()
    assert correlation is not None
    assert correlation.share > 0.3
    assert correlation_under(rests) is None


def test_white_noise_of_a_robot_stays_white(tmp_path: Path, trial: ModuleType) -> None:
    assert robot_fit(tmp_path, trial, 0.0).correlation() is None


def test_readings_of_a_pose_share_one_part_of_the_noise() -> None:
    """Of two runs, one shorter: the inverse of the triangle of Cholesky of the covariance by its definition."""
    rho, share = 0.9, 0.6
    pose = np.array([[0, 0, 0, 1, 1, 2, 2], [3, 3, 4, 5, 5, -1, -1]])
    rows = from_pose_to_pose(Rows(pose >= 0, 1, None), pose.reshape(-1))
    units = np.zeros((14, 2, 7))
    units[np.arange(14), np.arange(14) // 7, np.arange(14) % 7] = 1.0
    filtered = Whitening(rows, Correlation(rho, share))(units)
    for run, poses in enumerate(pose):
        inside = poses >= 0
        along = np.cumsum(np.where(np.diff(poses[inside], prepend=poses[0]) > 0, 1.0, WITHIN_A_POSE))
        covariance = share * rho ** np.abs(np.subtract.outer(along, along)) + (1.0 - share) * np.eye(
            len(along)
        )
        triangle = filtered[7 * run : 7 * run + 7, run].T[np.ix_(inside, inside)]
        np.testing.assert_allclose(triangle, np.linalg.inv(np.linalg.cholesky(covariance)), atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [202, *(pytest.param(seed, marks=pytest.mark.all_seeds) for seed in (229, 239))]
)
def test_a_tracker_that_walks_is_no_drift(trial: ModuleType, seed: int) -> None:
    """Each was told as a warm-up or an even drift of the tracker."""
    assert trial.told(seed, "walks", 2)[0] == []


@pytest.mark.slow
def test_a_tracker_that_walks_hides_no_warm_up(trial: ModuleType) -> None:
    names, _ = trial.told(0, "walks and warms up", 2)
    assert [each[0].partition("@")[0] for each in names] == ["tracker:shift"]
