"""A ball that shakes in its seat: named as one suspect with how much it scatters, at rates over seeds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from by_path import simulator

from monitor.discovery import Verdict, fit
from monitor.discovery.machine.suspects.scatter import scattering
from monitor.methods.samba.method import problem_of
from monitor.records import Campaign


def shake(campaign: Campaign, told: dict[str, Any], ball: str, size_um: float, seed: int) -> None:
    """Add white noise of its own, in the machine's axes, to the readings of a ball."""
    rng = np.random.default_rng((seed, 7))
    own = told["target"] == ball
    for axis in "XYZ":
        campaign.probings.readings[axis][own] += 1e-3 * size_um * rng.standard_normal(int(own.sum()))


@pytest.mark.parametrize("ball", ["1", "2", "3", "4"])
def test_a_ball_that_shakes_is_named_with_how_much(virtual_campaigns, seeds, ball):
    """Hidden: 6 µm beside 1 µm of the probe, so 6.08 times as much; of 4 runs as well as of 8."""
    times = []
    for seed in seeds(20, 2):
        for days in (1, 2):
            campaign, told = virtual_campaigns.virtual(9100 + seed, days=days)
            shake(campaign, told, ball, 6.0, seed)
            scatter = scattering(fit(problem_of(campaign)))
            assert scatter is not None
            assert scatter.target == ball
            times.append(scatter.times)
    assert np.median(times) > 4.0


def test_ordinary_campaigns_have_no_ball_that_scatters(virtual_campaigns, seeds):
    """White, with tails and with neighbours alike; 1e-4 by noise alone, so none."""

    def tails(rng: np.random.Generator, run: np.ndarray) -> np.ndarray:
        return rng.standard_t(3, (len(run), 3)) / np.sqrt(3.0)

    def alike(rng: np.random.Generator, run: np.ndarray) -> np.ndarray:
        noise = rng.standard_normal((len(run), 3))
        for row in range(1, len(run)):
            if run[row] == run[row - 1]:
                noise[row] = 0.8 * noise[row - 1] + 0.6 * noise[row]
        return noise

    for seed in seeds(100, 8):
        for noise in (None, tails, alike):
            campaign, _ = virtual_campaigns.virtual(9300 + seed, days=1, noise=noise)
            assert scattering(fit(problem_of(campaign))) is None


def test_of_runs_that_are_copies_no_ball_scatters(virtual_campaigns):
    """Readings that repeat to the last digit have no scatter to hold one against; it was divided by."""
    campaign, _ = virtual_campaigns.virtual(9400, days=1)
    for axis in "XYZ":
        readings = campaign.probings.readings[axis]
        readings[:] = np.tile(readings[: len(readings) // 4], 4)
    assert scattering(fit(problem_of(campaign))) is None


@pytest.mark.all_seeds
def test_an_explanation_names_the_ball_alone(virtual_campaigns, explained):
    """It was 40 bad points. How much the ball scatters is said to 15 %."""
    campaign, told = virtual_campaigns.virtual(9400, days=2)
    shake(campaign, told, "3", 6.0, 9400)
    answer = explained(campaign)
    (scatter,) = answer.scatter
    assert scatter.target == "3"
    assert scatter.touches == int(np.sum(told["target"] == "3"))
    assert scatter.times == pytest.approx(np.hypot(6.0, 1.0), rel=0.15)
    assert scatter.deviation * 1e3 == pytest.approx(np.hypot(6.0, 1.0), rel=0.15)
    assert answer.suspect == answer.moves == answer.missing == answer.limits == ()
    assert answer.comparison.verdict is Verdict.EXPLAINED


@pytest.mark.slow
def test_a_ball_that_shakes_hides_no_effect(virtual_campaigns, explained):
    sim = simulator()
    campaign, told = virtual_campaigns.virtual(9500, [sim.Effect("EYX:poly2", peak_um=6.0)], days=2)
    shake(campaign, told, "2", 6.0, 9500)
    answer = explained(campaign)
    assert [effect.effect for effect in answer.missing] == ["EYX:poly2"]
    assert [scatter.target for scatter in answer.scatter] == ["2"]
    assert answer.suspect == ()


@pytest.mark.slow
def test_a_wreck_of_a_ball_that_shakes_is_a_bad_point_still(virtual_campaigns, explained):
    campaign, told = virtual_campaigns.virtual(9600, days=2, bad_points=[(3, 9, (0.0, 90.0, 0.0))])
    ball = str(told["target"][(told["run"] == 3) & (told["sequence"] == 9)][0])
    shake(campaign, told, ball, 6.0, 9600)
    answer = explained(campaign)
    assert [scatter.target for scatter in answer.scatter] == [ball]
    assert [(point.run, point.sequence) for point in answer.suspect] == [(3, 9)]
