"""The worm of a mount stands out of noise that neighbours share, in whatever directions these follow each other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery.machine.fit import Fit, fit
from monitor.discovery.machine.noise.correlation import Correlation
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.gears import gear_variants
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from tests.simulator.instruments import SimulatedAxis, SimulatedChain, Y, Z

SETUP = """
[[setups]]
id = "sky"
reading = "direction"
standard_uncertainty_urad = 5.0
tool_direction = [1.0, 0.0, 0.0]
"""
MOUNT = SimulatedChain((SimulatedAxis("AZ", "rotary", Z, sign=-1), SimulatedAxis("EL", "rotary", Y, sign=-1)))
STARS, TEETH, NOISE = 120, 180, 5e-6
WORM = f"ECAZ:harmonic{TEETH}"
SLOW = (0.998, 0.89)


def night(folder: Path, worm: float) -> Fit:
    """The fit of a night in which the azimuth is off by ``worm`` rad, once a tooth."""
    rng = np.random.default_rng(5)
    rows: list[dict[str, object]] = []
    for _ in range(STARS):
        azimuth, elevation = (round(float(rng.uniform(*limits)), 5) for limits in ((0, 360), (15, 80)))
        turned = np.rad2deg(worm * np.cos(np.deg2rad(TEETH * azimuth) + 0.7))
        star = MOUNT.pose({"AZ": azimuth + turned, "EL": elevation})[:3, 0] + NOISE * rng.standard_normal(3)
        star = star / np.linalg.norm(star)
        at = {"AZ": azimuth, "EL": elevation}
        rows.append(
            {"setup": "sky", **at, "direction_x": star[0], "direction_y": star[1], "direction_z": star[2]}
        )
    campaign = read_campaign(MOUNT.write(folder / "night", SETUP, rows))
    return fit(campaign_method(campaign).problem_of(campaign))


@pytest.fixture(scope="module")
def with_worm(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    return night(tmp_path_factory.mktemp("worm"), 20e-6)


@pytest.mark.parametrize("frame", [None, 0, 1, 2])
def test_a_worm_stands_out_in_every_frame_of_correlated_noise(with_worm: Fit, frame: int | None) -> None:
    noise = None if frame is None else Correlation(*SLOW, frame)
    scene = scene_of(with_worm.with_correlation(noise), [])
    assert WORM in [variant.effect.text for variant in gear_variants(scene, [], 0.01)]


@pytest.mark.parametrize("frame", [None, 0, 1, 2])
def test_no_gear_stands_out_of_readings_without_one(tmp_path: Path, frame: int | None) -> None:
    noise = None if frame is None else Correlation(*SLOW, frame)
    scene = scene_of(night(tmp_path, 0.0).with_correlation(noise), [])
    assert gear_variants(scene, [], 0.01) == []
