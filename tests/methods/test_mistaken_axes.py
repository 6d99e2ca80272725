"""Angles in radians under an R-test: named by what makes the tool point stay, not by a unit in which nothing moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.units import DEGREE
from tests.methods.test_signs_of_machines import OFF, TOOL, chain_of, reach, tip

SPHERE = np.array([70.0, 20.0, 30.0])
SETUP = f"""
[[setups]]
id = "sphere"
reading = "vector"
instrument = "R-test"
standard_uncertainty_um = 0.5
tool_point_mm = {TOOL.tolist()}
"""


@pytest.fixture
def trunnion(tmp_path: Path) -> Callable[[str], Campaign]:
    """An R-test while both axes of a trunnion turn, with more lines of its setup."""

    def measured(lines: str) -> Campaign:
        chain, rows = chain_of("trunnion", {"A": (0.02, -0.01, 0.02, 0.0, 5e-5, 0.0)}, {}), []
        for a, c in np.random.default_rng(3).uniform(-90.0, 90.0, (20, 2)).tolist():
            readings = reach(chain, {"A": a, "C": c}, SPHERE)
            vector = 1e3 * (tip(chain, readings) - SPHERE - OFF)
            rows.append(
                {"setup": "sphere", **readings, **dict(zip(("dx_um", "dy_um", "dz_um"), vector, strict=True))}
            )
        return read_campaign(chain.write(tmp_path / "trunnion", SETUP + lines, rows))

    return measured


def mistaken(campaign: Campaign, factors: dict[str, float]) -> str | None:
    """What the positions say of the axes, with the columns of some times a factor."""
    readings = {name: x * factors.get(name, 1.0) for name, x in campaign.probings.readings.items()}
    changed = replace(campaign, probings=replace(campaign.probings, readings=readings))
    return campaign_method(changed).problem_of(changed).mistaken_axes()


@pytest.mark.parametrize("lines", ["", f"work_point_mm = {SPHERE.tolist()}\n"], ids=["anywhere", "stated"])
def test_angles_in_radians_are_named_by_their_columns(
    trunnion: Callable[[str], Campaign], lines: str
) -> None:
    """In µm no linear axis would move, and the tool point stay at the axis: "by 1.1 mm if x_mm, y_mm and z_mm were in
    µm" was said until November 2026."""
    campaign, radians = trunnion(lines), DEGREE.factor
    assert mistaken(campaign, {}) is None
    for factors, said in (
        ({"A": radians, "C": radians}, "mm if a_deg and c_deg were in radians"),
        ({"A": radians}, "mm if a_deg was in radians"),
        ({"C": radians}, "mm if c_deg was in radians"),
        # A unit that really is smaller still is told.
        (dict.fromkeys("XYZ", 1e3), "mm if x_mm, y_mm and z_mm were in µm"),
        (dict.fromkeys("XYZ", 10.0), "mm if x_mm, y_mm and z_mm were ten times too large"),
    ):
        words = mistaken(campaign, factors)
        assert words is not None
        assert words.endswith(said)
