"""A laser along X, there and back at the same positions in every run, of an axis whose error is a curve."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.readers import read_campaign
from monitor.records import Campaign
from tests.simulator.instruments import WAYS, SimulatedAxis, SimulatedChain, laser


def laser_along_x(
    folder: Path, runs: Sequence[Sequence[float]], error_um: Callable[[float], float], seed: int
) -> tuple[Campaign, ChainProblem]:
    """The campaign and its problem of runs, each with its positions in mm; 0.5 um of noise."""
    rng = np.random.default_rng(seed)
    chain = SimulatedChain(tuple(SimulatedAxis(name, "linear", way) for name, way in WAYS.items()))
    rows: list[dict[str, object]] = []
    for run, positions in enumerate(runs, 1):
        for x in [*positions, *positions[::-1]]:
            reading = 1e3 * x + error_um(x) + rng.normal(0.0, 0.5)
            rows.append(
                {"run": run, "setup": "laser", "X": x, "Y": 0.0, "Z": 0.0, "reading_um": round(reading, 2)}
            )
    days = [f"2026-03-{day:02d}T20:00:00+00:00" for day in range(2, 2 + len(runs))]
    campaign = read_campaign(chain.write(folder, laser(), rows, started=days))
    assert isinstance(campaign, Campaign)
    return campaign, campaign_method(campaign).problem_of(campaign)


def wave(pitch: float, phase: float = 0.4) -> Callable[[float], float]:
    """A wave of 4 um."""
    return lambda x: float(4.0 * np.sin(2.0 * np.pi * x / pitch + phase))
