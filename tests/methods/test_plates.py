"""A plate of known balls measured by two axes: readings of points in a plane, simulated here with numpy alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import explain
from monitor.discovery.machine.missing import ChainMissing
from monitor.discovery.machine.shapes.variants import NEVER_FOUND, without_aliases
from monitor.discovery.search.candidate import Variant
from monitor.effects import parse_effect
from monitor.methods import campaign_method
from monitor.readers import read_campaign

TOML = """format = 1
campaign = "{name}"
method = "instruments"

[machine]
id = "{name}"

[[machine.tool_chain]]
name = "Y"
kind = "linear"
along = "Y"

[[machine.tool_chain]]
name = "X"
kind = "linear"
along = "X"

[[setups]]
id = "plate"
reading = "point"
instrument = "ball plate"
standard_uncertainty_um = 0.5
"""


def plate(
    folder: Path,
    seed: int,
    error: Callable[[np.ndarray], np.ndarray],
    *,
    pitch: float = 50.0,
    count: int = 7,
    growth: float = 0.0,
    askew: float = 0.0,
) -> Path:
    """Balls on a square grid, read once in serpentines, 10 to 20 µm/m of gains, 15 µrad out of square; ``error`` (n, 2)
    mm of x (n,) mm is hidden. The plate grows by ``growth`` while it is read, and lies ``askew`` (rad) on the table."""
    rng = np.random.default_rng(seed)
    i, j = np.meshgrid(np.arange(count), np.arange(count))
    i[1::2] = i[1::2, ::-1]
    x = 100.0 + pitch * i.ravel() + np.round(rng.normal(0.0, 0.002, count**2), 4)
    y = 50.0 + pitch * j.ravel() + np.round(rng.normal(0.0, 0.002, count**2), 4)
    x, y = x - askew * (y - 200.0), y + askew * (x - 250.0)
    middle, grown = np.array([250.0, 200.0]), growth * np.linspace(0.0, 1.0, count**2)
    x, y = x + grown * (x - middle[0]), y + grown * (y - middle[1])
    place = np.stack([x * (1.0 + 20e-6) - 15e-6 * y, y * (1.0 - 12e-6)], axis=1) + error(x)
    place += rng.normal(0.0, 0.5e-3, place.shape)
    # What the plate's certificate states: it has not grown.
    place -= grown[:, None] * (place - middle)
    turn = rng.normal(0.0, 0.3)
    seen = place @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) + [12.0, -30.0]
    target = folder / f"plate-{seed}"
    target.mkdir()
    (target / "campaign.toml").write_text(TOML.format(name=target.name), encoding="utf-8")
    (target / "runs.csv").write_text(
        "run,started_at,day,warm_up,ambient_degC\n1,2025-02-01T08:00:00+00:00,1,false,20.0\n",
        encoding="utf-8",
    )
    lines = ["run,sequence,time_s,setup,x_mm,y_mm,point_x_mm,point_y_mm"]
    lines += [
        f"1,{n + 1},{10.0 * n},plate,{x[n]:.4f},{y[n]:.4f},{seen[n, 0]:.5f},{seen[n, 1]:.5f}"
        for n in range(len(x))
    ]
    (target / "probings.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return target


def missing(folder: Path) -> list[ChainMissing]:
    campaign = read_campaign(folder)
    problem = campaign_method(campaign).problem_of(campaign)
    answer = explain(campaign, problem, "instruments", rng=np.random.default_rng(1))
    return list(answer.missing)


def bow(x: np.ndarray) -> np.ndarray:
    """4 µm of straightness over the plate, as a parabola about its middle."""
    return np.stack([np.zeros_like(x), 4e-3 * ((x - 250.0) / 150.0) ** 2], axis=1)


def screw(x: np.ndarray) -> np.ndarray:
    return np.stack([2e-3 * np.sin(2.0 * np.pi * x / 16.0), np.zeros_like(x)], axis=1)


@pytest.mark.parametrize("seed", range(5))
def test_a_parabola_off_the_zero_of_the_axis_is_a_square_and_not_a_cube(seed: int, tmp_path: Path) -> None:
    """Was: EYX:poly3 on two plates of three. From 100 to 400 mm a cube bends nearly as a square does."""
    (finding,) = missing(plate(tmp_path, seed, bow))
    assert finding.effect == "EYX:poly2"
    assert abs(finding.coefficients[0] - 4e-3 / 150.0**2) < 4.0 * finding.u


@pytest.mark.parametrize("seed", range(3))
def test_a_lead_is_found_where_its_wave_repeats_at_the_balls(seed: int, tmp_path: Path) -> None:
    """16 mm on balls 20.5 mm apart shows as a wave of 73 mm, four times over the plate."""
    (finding,) = missing(plate(tmp_path, seed, screw, pitch=20.5, count=15))
    assert finding.effect == "EXX:cyclic16mm"


def test_a_lead_that_the_positions_take_for_a_bend_is_never_found(tmp_path: Path) -> None:
    """12 mm on balls 50 mm apart is a wave of 300 mm, whatever the rounding of the positions."""
    campaign = read_campaign(plate(tmp_path, 0, bow))
    context = campaign_method(campaign).problem_of(campaign).context
    variants = [
        Variant(text, parse_effect(text, context.chain))
        for text in ("EXX:cyclic12mm", "EXX:cyclic16mm", "EXX:cyclic32mm", "EXX:poly2")
    ]
    odds = [variant.odds for variant in without_aliases(variants, context, {})]
    # Of 16 and 32 mm the waves are of 400 and 114 mm, of which 0.75 and 2.6 lie on the plate.
    assert odds == [NEVER_FOUND, NEVER_FOUND, 1.0, 1.0]
    stated = without_aliases(variants, context, {"X": 12.0})
    assert stated[0].odds == 1.0


def test_a_plate_without_errors_of_shape_shows_none(tmp_path: Path) -> None:
    nothing = [missing(plate(tmp_path, seed, lambda x: np.zeros((len(x), 2)))) for seed in range(10)]
    assert nothing == [[]] * 10


def test_an_axis_that_stands_still_shows_no_lead(tmp_path: Path) -> None:
    campaign = read_campaign(plate(tmp_path, 0, bow, count=5))
    context = campaign_method(campaign).problem_of(campaign).context
    lead = Variant("EXX:cyclic12mm", parse_effect("EXX:cyclic12mm", context.chain))
    still = replace(context, positions=np.zeros_like(context.positions))
    assert [variant.odds for variant in without_aliases([lead], still, {})] == [NEVER_FOUND]


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 4))])
def test_a_plate_that_grows_is_no_screw_that_warms_up(seed: int, tmp_path: Path) -> None:
    """Was: EYY:poly1@run_time alone."""
    (finding,) = missing(plate(tmp_path, seed, lambda x: np.zeros((len(x), 2)), growth=25e-6))
    held = ",".join(f"{place.axis}={place.reading:g}" for place in finding.held)
    assert finding.effect == f"instrument:plate:expansion{f'({held})' if held else ''}@run_time"
    # It grows about (250, 200), the middle of its balls, as where no place is named; one that is named beside it says
    # more than the middle, which chance does from some 3 u on.
    for place in finding.held:
        assert abs(place.reading - {"X": 250.0, "Y": 200.0}[place.axis]) < 4.0 * place.u
        assert place.u < 100.0
    assert abs(finding.amplitude - 25e-6) < 4.0 * finding.u


def test_a_plate_that_lies_askew_stands_on_a_grid_still(tmp_path: Path) -> None:
    """Was: EXX:cyclic32mm as the only finding, of which the balls show 0.75 of a wave: 0.3 mrad are 0.1 mm over it."""
    campaign = read_campaign(plate(tmp_path, 0, bow, pitch=60.0, askew=5e-4))
    context = campaign_method(campaign).problem_of(campaign).context
    assert np.ptp(np.sort(context.positions[:, context.chain.index("X")])[:7]) > 0.1
    lead = Variant("EXX:cyclic32mm", parse_effect("EXX:cyclic32mm", context.chain))
    assert [variant.odds for variant in without_aliases([lead], context, {})] == [NEVER_FOUND]
