"""A warm-up that is shorter than any time constant of the grid is one finding with its size, and no pair that cancels.

The readings come from a closed form: a laser along X whose gain grows towards its end, by rows that count no seconds.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import Explanation, explain
from monitor.discovery.machine.shapes import refine
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.records import Campaign
from tests.simulator.instruments import SimulatedAxis, SimulatedChain

#: Of a reading, mm; what the gain grows by, and within how many rows.
NOISE, GROWTH, ROWS = 3e-4, 40e-6, 100.0
SETUP = (
    '\n[[setups]]\nid = "laser"\nreading = "displacement"\nstandard_uncertainty_um = {u_um}\n'
    'direction = "X"\nknown = ["direction"]\ntool_point_mm = [0, 0, 0]\n'
)


def _explained(folder: Path, seed: int) -> Explanation:
    stops = np.linspace(0.0, 500.0, 11)
    x = np.concatenate([stops[:: (-1) ** way] for way in range(30)])
    grown = GROWTH * -np.expm1(-np.arange(1.0, len(x) + 1.0) / ROWS)
    reading = x * (1.0 + grown) + np.random.default_rng(seed).normal(0.0, NOISE, len(x))
    rows = [
        {"setup": "laser", "X": float(at), "reading_um": 1e3 * float(value)}
        for at, value in zip(x, reading, strict=True)
    ]
    chain = SimulatedChain((SimulatedAxis("X", "linear", (1.0, 0.0, 0.0)),))
    campaign = read_campaign(chain.write(folder / "laser", SETUP.format(u_um=1e3 * NOISE), rows))
    assert isinstance(campaign, Campaign)
    probings = campaign.probings
    counted = replace(campaign, probings=replace(probings, time=probings.sequence.astype(float)))
    problem = campaign_method(counted).problem_of(counted)
    return explain(counted, problem, "instruments", rng=np.random.default_rng(1))


def test_a_warm_up_below_the_grid_is_one_finding(tmp_path: Path, seeds: Callable[[int, int], range]) -> None:
    """The scale of the laser does the same, and is its rival, whichever of the two leads."""
    pair = {"EXX:poly1@warmup", "instrument:laser:scale@warmup"}
    for seed in seeds(20, 1):
        (folder := tmp_path / str(seed)).mkdir()
        (found,) = _explained(folder, seed).missing
        assert {found.effect, *(rival.effect for rival in found.rivals)} == pair
        assert abs(found.amplitude - GROWTH) < 3.5 * found.u


def test_of_two_that_cancel_within_their_uncertainty_one_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where no time constant below the grid is tried a drift is added that takes back half of the warm-up; the time
    constant, searched beside it, leaves neither a size."""
    monkeypatch.setattr(refine, "MOST_BELOW_GRID", 1)
    monkeypatch.setattr(sys.modules[__name__], "NOISE", 1.5e-3)
    (found,) = _explained(tmp_path, 0).missing
    assert found.effect == "EXX:poly1@warmup"
    assert found.amplitude > 2.0 * found.u
