"""A rotary table whose sign is wrong, under an R-test: simulated by numpy alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from monitor.discovery import find_reading_mistakes, fit
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from tests.simulator.instruments import SimulatedAxis, SimulatedChain, Z

SPHERE = """
[[setups]]
id = "sphere"
reading = "vector"
instrument = "R-test"
frame = "tool"
tool_point_mm = [0.0, 0.0, 100.0]
work_point_mm = [0.0, 0.0, 100.0]
standard_uncertainty_um = 0.2
"""


def mistakes(folder: Path, sign: int) -> list[str]:
    """What looks wrong in the file of a table that turns the work by minus its reading, its sphere 10 um off centre."""
    rng = np.random.default_rng(4)
    rows = [
        {
            "setup": "sphere",
            "C": angle,
            "dx_um": -10.0 * np.cos(np.radians(-angle)) + rng.normal(0.0, 0.2),
            "dy_um": -10.0 * np.sin(np.radians(-angle)) + rng.normal(0.0, 0.2),
            "dz_um": rng.normal(0.0, 0.2),
        }
        for angle in np.arange(0.0, 361.0, 10.0)
    ]
    table = SimulatedChain((), (SimulatedAxis("C", "rotary", Z, sign=sign),))
    folder = table.write(folder / f"sign{sign}", SPHERE, rows)
    campaign = read_campaign(folder)
    maker = campaign_method(campaign).problem_of
    return [mistake.what for mistake in find_reading_mistakes(campaign, maker, fit(maker(campaign)))]


def test_the_sign_of_the_axis_is_among_what_mirrors_the_readings(tmp_path):
    """Columns exchanged, one with the other sign and an axis that turns backwards mirror a circle alike."""
    assert mistakes(tmp_path, -1) == []
    first, *others = mistakes(tmp_path, 1)
    assert first == "the sign of C were the other way round (`sign` of C in campaign.toml)"
    assert "the sign of dx_um were the other way round" in others
