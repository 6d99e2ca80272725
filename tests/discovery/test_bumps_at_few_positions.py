"""A bump of an axis that was read at seven positions of its travel, where two waves and a parabola follow anything."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import Explanation, explain
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from tests.simulator.instruments import SimulatedAxis, SimulatedChain, X, Y, Z
from tests.simulator.parts_on_a_cmm import CHAIN, SETUP

TIP = np.array([0.0, 0.0, -150.0])
TRACKER = """
[[setups]]
id = "tracker"
reading = "point"
instrument = "tracker"
standard_uncertainty_um = 2.0
tool_point_mm = [0.0, 0.0, -150.0]
known = ["scale"]
"""


def found_in(folder: Path) -> Explanation:
    """What the model of a campaign lacks."""
    campaign = read_campaign(folder)
    problem = campaign_method(campaign).problem_of(campaign)
    return explain(campaign, problem, "instruments", rng=np.random.default_rng(1))


def bump(part: float) -> float:
    """8 um at 0.3 of half of the travel from its middle, a fifth of that wide; ``part`` goes from -1 to 1."""
    return float(8e-3 * np.exp(-(((part - 0.3) / 0.2) ** 2)))


def part_of_70(folder: Path, seed: int, error: Callable[[float], float]) -> Path:
    """A part of 70 holes, 93 mm apart along Y, measured by a CMM whose Y is off by an error of a part of its
    travel."""
    rng = np.random.default_rng(seed)
    gain, turn, shift = rng.normal(0.0, 8e-6, 2), rng.uniform(-3.0, 3.0), rng.normal(0.0, 200.0, 2)
    c, s = np.cos(turn), np.sin(turn)
    rows: list[dict[str, object]] = []
    for x, y in product(np.linspace(0.0, 630.0, 10), 93.0 * np.arange(7)):
        u, v = x * (1.0 + gain[0]), y * (1.0 + gain[1]) + error(y / 279.0 - 1.0)
        at = np.array([c * u - s * v, s * u + c * v]) + shift + rng.normal(0.0, 1.5e-3, 2)
        rows.append(
            {"setup": "cmm", "X": x, "Y": y, "Z": -20.0}
            | {"point_x_mm": round(at[0], 4), "point_y_mm": round(at[1], 4), "point_z_mm": None}
        )
    return CHAIN.write(folder, SETUP, rows)


@pytest.mark.parametrize("seed", [3, pytest.param(4, marks=pytest.mark.all_seeds)])
def test_a_bump_is_no_two_leads_that_look_long_at_its_positions(tmp_path: Path, seed: int) -> None:
    """Leads of 20 mm (7.5 um) and of 5 mm (6.4 um) were told, which are waves of 266 and 232 mm at 93 mm a step."""
    (missing,) = found_in(part_of_70(tmp_path / "part", seed, bump)).missing
    assert missing.effect.startswith("EYY:free(")
    assert 1e3 * missing.peak == pytest.approx(6.0, abs=1.0)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.all_seeds)])
def test_a_wave_of_fewer_than_two_periods_is_a_free_shape(tmp_path: Path, seed: int) -> None:
    """A cycle of 317 mm was told of 558 mm of travel: whether that repeats nobody can say. Without it two leads would
    be, of 14 and 10 um, which take each other back."""
    wave = lambda part: 6e-3 * np.sin(2.0 * np.pi * 279.0 * part / 320.0)  # noqa: E731
    (missing,) = found_in(part_of_70(tmp_path / "part", seed, wave)).missing
    assert missing.effect.startswith("EYY:free(")


def test_of_pitches_that_are_one_at_the_positions_the_longest_leads(tmp_path: Path) -> None:
    """A wave of 200 mm was one of 173.5 mm: 1/93 - 1/200 = 1/173.8. It is named with it now."""
    wave = lambda part: 6e-3 * np.sin(2.0 * np.pi * 279.0 * part / 200.0 + 0.7)  # noqa: E731
    (missing,) = found_in(part_of_70(tmp_path / "part", 3, wave)).missing
    assert missing.searched is not None
    assert missing.searched.u is not None
    assert abs(missing.searched.value - 200.0) < 3.0 * missing.searched.u
    assert missing.searched.value > 2.0 * 93.0
    assert "EYY:cyclic173.5" in {rival.effect[:15] for rival in missing.rivals}


def tracked_machine_with_a_bump(folder: Path, seed: int) -> Path:
    """Three axes read by a tracker at 231 poses of two runs, Y at seven positions 93 mm apart; Y has the bump, and the
    frame warms up by 3 K, of which nothing moves."""
    rng = np.random.default_rng(seed)
    chain = SimulatedChain(
        tuple(
            SimulatedAxis(
                name, "linear", along, errors=(0.0, 0.0, 0.0, *rng.normal(0.0, 3e-5, 3)), motion=motion
            )
            for name, along, motion in (
                ("X", X, lambda q: (q * 1.2e-5, 0.0, 0.0, 0.0, 0.0, 0.0)),
                ("Y", Y, lambda q: (0.0, bump(q / 300.0) - q * 0.7e-5, 0.0, 0.0, 0.0, 0.0)),
                ("Z", Z, lambda q: (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
            )
        )
    )
    rows: list[dict[str, object]] = []
    for run in (1, 2):
        shift = rng.normal(0.0, 300.0, 3)
        poses = product((-180.0, 0.0, 180.0), np.linspace(-280.0, 280.0, 7), np.linspace(-380.0, 380.0, 11))
        for pose, (z, y, x) in enumerate(poses):
            readings = {"X": x, "Y": y, "Z": z}
            at = (chain.seen(readings) @ [*TIP, 1.0])[:3] + shift + rng.normal(0.0, 2e-3, 3)
            rows.append(
                {"run": run, "setup": "tracker", "frame_degC": round(23.0 - 3.0 * np.exp(-pose / 125.0), 2)}
                | readings
                | dict(zip(("point_x_mm", "point_y_mm", "point_z_mm"), np.round(at, 5).tolist(), strict=True))
            )
    return chain.write(folder, TRACKER, rows, started=[f"2026-03-0{day}T08:00:00+00:00" for day in (2, 3)])


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.all_seeds) for seed in (1, 2))])
def test_a_bump_is_no_wave_with_powers(tmp_path: Path, seed: int) -> None:
    """A cycle of 224 mm with a cube and a parabola was told: its pitch was sought, and came back as if known."""
    (missing,) = found_in(tracked_machine_with_a_bump(tmp_path / "machine", seed)).missing
    assert missing.effect.startswith("EYY:free(")
