"""Ball bars in several planes of one run: simulated by the distance of two points, without a line of the package."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from monitor.discovery import explain
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.records import Campaign
from tests.simulator.instruments import WAYS, SimulatedAxis, SimulatedChain

CENTRE, LENGTH = np.array([200.0, 150.0, 300.0]), 100.0
BAR = """
[[setups]]
id = "bar-{plane}"
reading = "distance"
instrument = "ball bar"
standard_uncertainty_um = 0.3
tool_point_mm = [0.0, 0.0, 0.0]
work_point_mm = [200.0, 150.0, 300.0]
length_mm = 100.0
length_standard_uncertainty_um = 0.3
"""


#: Displacement (3,) in um at a place (3,) after a move (3,) in mm, for the directions (3,) of the axes.
Error = Callable[[np.ndarray, np.ndarray, np.ndarray], Sequence[float]]


def ball_bars(
    folder: Path,
    error_um: Error,
    degrees: tuple[float, float] = (0.0, 360.0),
    seed: int = 4,
    *,
    planes: Sequence[str] = ("xy", "yz"),
    in_mm: Sequence[str] = (),
) -> Campaign:
    """The campaign of a bar there and back in every plane, brought into each along its circle; ``error_um`` of
    position, last move and direction of every axis is a displacement. The planes ``in_mm`` were written in mm."""
    rng = np.random.default_rng(seed)
    rows = []
    for plane in planes:
        first, second = ("xyz".index(letter) for letter in plane)
        for sense in (1.0, -1.0):
            angles = np.arange(*degrees, 5.0)[:: int(sense)]
            way = np.radians([angles[0] - 10.0 * sense, angles[0] - 5.0 * sense, *angles])
            places = np.tile(CENTRE, (len(way), 1))
            places[:, first] += LENGTH * np.cos(way)
            places[:, second] += LENGTH * np.sin(way)
            direction = np.zeros(3)
            for index in range(1, len(way)):
                move = places[index] - places[index - 1]
                direction = np.where(np.abs(move) > 1e-6, np.sign(move), direction)
                # Nobody knows how a place was come to that was left and is read again.
                if index > (1 if sense > 0.0 else 2):
                    moved = places[index] + 1e-3 * np.asarray(error_um(places[index], move, direction))
                    reading = 1e3 * (np.linalg.norm(moved - CENTRE) - LENGTH) + rng.normal(0.0, 0.3)
                    x, y, z = places[index].round(4).tolist()
                    scale = 1e-3 if plane in in_mm else 1.0
                    rows.append(
                        {"run": 1, "setup": f"bar-{plane}", "X": x, "Y": y, "Z": z}
                        | {"reading_um": reading * scale}
                    )
    chain = SimulatedChain(tuple(SimulatedAxis(name, "linear", way) for name, way in WAYS.items()))
    setups = "".join(BAR.format(plane=plane) for plane in planes)
    return read_campaign(chain.write(folder / "bars", setups, rows, started=["2026-03-02T20:00:00+00:00"]))


def named(campaign: Campaign) -> dict[str, float]:
    """The effects that a search names, the first first."""
    problem = campaign_method(campaign).problem_of(campaign).for_search()
    answer = explain(campaign, problem, "instruments", rng=np.random.default_rng(1))
    return {each.effect: each.amplitude for each in answer.missing}
