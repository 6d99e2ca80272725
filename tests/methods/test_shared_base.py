"""One base for all runs of a session: three set-ups of a tracker before one robot."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from monitor.methods.model import SHARED_BASE, Model
from monitor.methods.tracker.method import METHOD
from monitor.readers import read_campaign
from monitor.records import Campaign
from tests.simulator import robot_campaign as robots


def session(folder: Path, seed: int, poses: tuple[int, ...] = (30, 30, 30)) -> Campaign:
    """Runs of one robot, each before a tracker that was set up anew."""
    rng = np.random.default_rng(seed)
    location = robots.errors_of_robot(rng)
    rows: list[str] = []
    for run, count in enumerate(poses, 1):
        track = robots.track(rng, poses=count, location=location)
        robots.write_tracked(folder / f"run{run}", track)
        head, *lines = (folder / f"run{run}" / "probings.csv").read_text().splitlines()
        rows += [f"{run},{line.partition(',')[2]}" for line in lines]
    campaign = folder / "session"
    campaign.mkdir()
    (campaign / "probings.csv").write_text("\n".join([head, *rows]) + "\n")
    (campaign / "campaign.toml").write_text(robots.campaign_text("session", 20.0, False))
    runs = [f"{run},2026-03-02T{7 + run:02d}:30:00+01:00,1,false,21.3" for run in range(1, len(poses) + 1)]
    (campaign / "runs.csv").write_text("\n".join(["run,started_at,day,warm_up,ambient_degC", *runs]) + "\n")
    return read_campaign(campaign)


def test_a_shared_base_is_the_weighted_mean_of_the_runs(tmp_path: Path) -> None:
    """Three fits of a base of their own, averaged with their covariances by numpy, are the one of all runs: to first
    order in errors of 1 mrad and 1 mm."""
    campaign = session(tmp_path, 1)
    alone = METHOD.identify(campaign)
    shared = METHOD.identify(campaign, Model("session", added=(SHARED_BASE,)))
    assert not shared.parameters
    assert shared.added == alone.parameters
    assert not shared.added_refused
    weights = [np.linalg.inv(run.covariance) for run in alone.runs]
    covariance = np.linalg.inv(sum(weights))
    mean = covariance @ sum(w @ run.estimate for w, run in zip(weights, alone.runs, strict=True))
    u = np.sqrt(np.diag(covariance))
    assert np.abs(shared.added_estimate - mean).max() < 0.05 * u.max() + 1e-6
    assert np.all(np.abs(shared.added_estimate - mean) < 0.2 * u)
    ratio = np.sqrt(np.diag(shared.added_covariance)) / u
    # Poses count as one observation each, which widens and never narrows.
    assert np.all((ratio > 0.98) & (ratio < 1.8))


def test_runs_too_short_for_a_base_of_their_own_share_one(tmp_path: Path) -> None:
    """Of a run of four poses each the frame alone would be known; together they hold the base."""
    campaign = session(tmp_path, 2, poses=(6,) * 8)
    shared = METHOD.identify(campaign, Model("session", added=(SHARED_BASE,)))
    assert not shared.added_refused
    assert all(run.rms < 30e-3 for run in shared.runs)
