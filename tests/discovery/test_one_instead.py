"""One shape of an error in place of two of it that do the same at few positions, simulated with numpy and scipy."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from monitor.discovery import Explanation, explain
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from tests.simulator.instruments import SimulatedAxis, SimulatedChain, X, Y, Z
from tests.simulator.parts_on_a_cmm import SETUP

VECTOR = ("dx_um", "dy_um", "dz_um")
BALL = """
[[setups]]
id = "{name}"
reading = "vector"
instrument = "R-test"
standard_uncertainty_um = 0.6
tool_point_mm = [0.0, 0.0, -120.0]
work_point_mm = {point}
"""


def found_in(folder: Path) -> Explanation:
    """What the model of a campaign lacks."""
    campaign = read_campaign(folder)
    problem = campaign_method(campaign).problem_of(campaign)
    return explain(campaign, problem, "instruments", rng=np.random.default_rng(1))


def part_with_a_wave(folder: Path, seed: int) -> Path:
    """A part of 80 holes, 70 mm apart along X, measured by a CMM: X has a wave of 4 um that repeats every 200 mm."""
    rng = np.random.default_rng(seed)
    chain = SimulatedChain(
        (SimulatedAxis("Z", "linear", Z),), (SimulatedAxis("Y", "linear", Y), SimulatedAxis("X", "linear", X))
    )
    turn, shift, gain = rng.uniform(-3.0, 3.0), rng.normal(0.0, 200.0, 2), rng.normal(0.0, 8e-6, 2)
    c, s = np.cos(turn), np.sin(turn)
    rows: list[dict[str, object]] = []
    for y in np.linspace(0.0, 420.0, 8):
        for x in np.linspace(0.0, 630.0, 10):
            u, v = x * (1.0 + gain[0]) + 4e-3 * np.sin(2.0 * np.pi * x / 200.0), y * (1.0 + gain[1])
            at = np.array([c * u - s * v, s * u + c * v]) + shift + rng.normal(0.0, 1.5e-3, 2)
            rows.append(
                {"setup": "cmm", "X": x, "Y": y, "Z": -20.0}
                | {"point_x_mm": round(at[0], 4), "point_y_mm": round(at[1], 4), "point_z_mm": None}
            )
    return chain.write(folder, SETUP, rows)


@pytest.mark.parametrize("seed", range(4))
def test_a_cycle_between_two_that_follow_it_at_few_positions_leads(tmp_path: Path, seed: int) -> None:
    """A lead of 16 mm was told in two of these parts, at 70 mm from hole to hole a wave of 187 mm, and nothing in one;
    in others one of 40 mm beside it."""
    (missing,) = found_in(part_with_a_wave(tmp_path / "part", seed)).missing
    assert missing.effect.startswith("EXX:cyclic")
    assert missing.searched is not None
    assert missing.searched.value == pytest.approx(200.0, abs=8.0)
    # 1/70 - 1/200 and 1/70 + 1/200: at 70 mm from hole to hole they are one.
    rivals = [float(rival.effect[len("EXX:cyclic") : -len("mm")]) for rival in missing.rivals]
    assert sorted(rivals) == pytest.approx([51.9, 107.7], abs=2.5)


def tables_of_five_angles(folder: Path) -> Path:
    """A ball at two places of two tables, C on A, both at five angles: C has five periods of 170 urad a turn."""
    rng = np.random.default_rng(1)
    wave = lambda c: (0.0, 0.0, 0.0, 0.0, 0.0, 170e-6 * np.sin(np.deg2rad(5.0 * c)))  # noqa: E731
    work = (SimulatedAxis("A", "rotary", X), SimulatedAxis("C", "rotary", Z, motion=wave))
    tool = (SimulatedAxis("X", "linear", X), SimulatedAxis("Y", "linear", Y), SimulatedAxis("Z", "linear", Z))
    chain = SimulatedChain(tool, work)
    tip, places = np.array([0.0, 0.0, -120.0]), {"one": (90.0, 0.0, 60.0), "two": (-40.0, 70.0, 150.0)}
    rows: list[dict[str, object]] = []
    for run, (name, place) in product((1, 2, 3), places.items()):
        shift = rng.normal(0.0, 0.03, 3)
        for a, c in product(np.linspace(-90.0, 90.0, 5), np.linspace(0.0, 315.0, 5)):
            at = Rotation.from_euler("XZ", [a, c], degrees=True).apply(place) - tip
            readings = dict(zip("XYZ", at.tolist(), strict=True)) | {"A": a, "C": c}
            seen = (chain.seen(readings) @ [*tip, 1.0])[:3] - place + shift + rng.normal(0.0, 0.6e-3, 3)
            rows.append(
                {"run": run, "setup": name} | readings | dict(zip(VECTOR, (1e3 * seen).tolist(), strict=True))
            )
    setups = "".join(BALL.format(name=name, point=list(place)) for name, place in places.items())
    return chain.write(folder, setups, rows, started=[f"2026-03-0{day}T20:00:00+00:00" for day in (2, 3, 4)])


@pytest.mark.slow
def test_one_wave_leads_that_two_follow_at_five_angles(tmp_path: Path) -> None:
    """`ECC:harmonic2` and `ECC:harmonic3` were told, and five periods a turn nowhere."""
    (missing,) = found_in(tables_of_five_angles(tmp_path / "tables")).missing
    assert missing.effect == "ECC:harmonic5"
    assert 1e6 * missing.amplitude == pytest.approx(170.0, abs=5.0)
