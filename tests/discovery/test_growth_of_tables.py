"""A rotary table that grows along its axis while a linear axis stands still: what grew, and what moves the tip alike.

The readings are those of a nest of three sensors, written here row by row.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import explain
from monitor.discovery.machine.explain import variants_of_campaign
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from tests.simulator.instruments import SimulatedAxis, SimulatedChain

#: What the table grows by (µm) with which time constant (s), and the noise of a reading (µm).
GROWTH, SETTLES, NOISE = 3.0, 1200.0, 0.5
#: Rows of a run, and the time between two, s.
ROWS, PERIOD = 96, 60.0
SETUP = (
    '\n[[setups]]\nid = "nest"\nreading = "vector"\nframe = "tool"\nstandard_uncertainty_um = 0.5\n'
    "tool_point_mm = [0, 0, 60]\nwork_point_mm = [0, 0, 60]\n"
)


@pytest.mark.slow
def test_a_table_that_grows_is_no_screw_of_an_axis_that_stands_still(tmp_path: Path) -> None:
    """Was EZ0Z@warmup, "the ball screw of Z warms up", without a rival."""
    rng = np.random.default_rng(5)
    rows = []
    for row in range(ROWS):
        grown = GROWTH * -np.expm1(-row * PERIOD / SETTLES)
        read = rng.normal(0.0, NOISE, 3) - [0.0, 0.0, grown]
        numbers = dict(zip(("dx_um", "dy_um", "dz_um"), map(float, read), strict=True))
        rows.append({"setup": "nest", "C": 15.0 * (row % 24), "Z": 0.0, **numbers})
    table = SimulatedAxis("C", "rotary", (0.0, 0.0, 1.0), sign=-1)
    chain = SimulatedChain((SimulatedAxis("Z", "linear", (0.0, 0.0, 1.0)),), work=(table,))
    folder = chain.write(tmp_path / "table", SETUP, rows)
    campaign = read_campaign(folder)
    problem = campaign_method(campaign).problem_of(campaign)
    (found,) = explain(campaign, problem, "instruments", rng=np.random.default_rng(1)).missing
    assert found.effect == "EZC:const@warmup"
    assert found.description.cause == "C or what it carries warms up and grows along its axis"
    assert ("EZ0Z@warmup", True) in [(rival.effect, rival.coincides) for rival in found.rivals]
    assert ("EZC:const@warmup", "EZ0Z@warmup") in found.separation.together


def test_a_table_is_looked_for_and_a_still_screw_is_less_likely(tmp_path: Path) -> None:
    rows = [
        {"setup": "nest", "C": 15.0 * row, "Z": 0.0, "dx_um": 0.0, "dy_um": 0.0, "dz_um": 0.1 * (row % 2)}
        for row in range(24)
    ]
    table = SimulatedAxis("C", "rotary", (0.0, 0.0, 1.0), sign=-1)
    chain = SimulatedChain((SimulatedAxis("Z", "linear", (0.0, 0.0, 1.0)),), work=(table,))
    campaign = read_campaign(chain.write(tmp_path / "table", SETUP, rows))
    problem = campaign_method(campaign).problem_of(campaign)
    odds = {each.family: each.odds for each in variants_of_campaign(campaign, problem, ["warmup"])}
    assert odds["EZC:const@warmup"] < odds["EZ0Z@warmup"]
