"""Pitches that positions on a grid do not show: of cycles where a plate lies askew, and of teeth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import Fit, fit
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.grids_askew import is_bend_of_another, other_bounds
from monitor.discovery.machine.shapes.teeth import teeth_of
from monitor.discovery.machine.shapes.variants import (
    ODDS_OF_A_PITCH_ASKEW,
    cycles_of_unknown_pitch,
    pitch_limits,
    resolvable,
    variants_of,
)
from monitor.effects import parse_effect
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from tests.discovery.test_off_in_places import PLACES, problem_of
from tests.simulator.parts_on_a_cmm import CHAIN, SETUP

Y = 0
#: Holes 80 mm apart: 17 periods from one to the next, and 17.4.
WHOLE, NO_WHOLE = 80.0 / 17.0, 80.0 / 17.4


def context_of(folder: Path, places):
    _, problem = problem_of(folder, 3, (0.0, 0.0, 0.0), runs=1, places=places)
    return problem.context


def test_what_goes_round_whole_times_on_a_plate_askew_is_a_bend_of_another_axis(tmp_path: Path) -> None:
    """A bend of EYX of 3 um was told as `EYY:cyclic4.75943mm` where the plate lay 10 mrad askew."""
    context = context_of(tmp_path / "plate", PLACES[:2])
    assert is_bend_of_another(WHOLE, Y, context)
    assert not is_bend_of_another(NO_WHOLE, Y, context)
    cycles = resolvable(cycles_of_unknown_pitch(context), context)
    odds = {each.effect.shape.pitch: each.odds for each in cycles if each.family == "EYY:cyclic"}
    assert {pitch for pitch, against in odds.items() if against == ODDS_OF_A_PITCH_ASKEW} == {
        pitch for pitch in odds if is_bend_of_another(pitch, Y, context)
    }
    assert {1.0, ODDS_OF_A_PITCH_ASKEW} == set(odds.values())


def test_none_is_refined_into_what_is_a_bend(tmp_path: Path) -> None:
    context = context_of(tmp_path / "plate", PLACES[:2])
    near = np.linspace(NO_WHOLE, 2.0 * WHOLE - NO_WHOLE, 201)
    low, high = other_bounds(NO_WHOLE, near, Y, context)
    assert low == 0.0
    assert NO_WHOLE < high < WHOLE
    assert other_bounds(NO_WHOLE, np.array([NO_WHOLE]), Y, context) == (0.0, np.inf)


@pytest.mark.parametrize(
    "places",
    [
        pytest.param(PLACES, id="a place turned by 0.3 rad"),
        pytest.param([(0.0, PLACES[0][1])], id="straight"),
        pytest.param([(0.2, PLACES[0][1])], id="several periods within a stop"),
    ],
)
def test_elsewhere_whole_turns_are_cycles(tmp_path: Path, places) -> None:
    assert not is_bend_of_another(WHOLE, Y, context_of(tmp_path / "plate", places))


def part_of(folder: Path, grid: list[tuple[float, float]]) -> Fit:
    """A fit of one part whose holes were cut at these places of X and Y."""
    rng = np.random.default_rng(5)
    rows: list[dict[str, object]] = []
    for x, y in grid:
        at = np.array([x, y]) + rng.normal(0.0, 1.5e-3, 2)
        rows.append(
            {"run": 1, "setup": "cmm", "X": x, "Y": y, "Z": -20.0}
            | {"point_x_mm": at[0], "point_y_mm": at[1], "point_z_mm": None}
        )
    campaign = read_campaign(CHAIN.write(folder, SETUP, rows))
    return fit(campaign_method(campaign).problem_of(campaign).for_search())


@pytest.mark.parametrize("steps", [5, 12])
def test_no_teeth_are_finer_than_twice_the_step_of_a_grid(tmp_path: Path, steps: int) -> None:
    """Of a part whose Y stood at five places, teeth of 47 mm were told in place of a bend."""
    first = part_of(tmp_path / "part", [(60.0 * i, 30.0 * j) for i in range(8) for j in range(steps)])
    context = first.problem.context
    (shape,) = variants_of(parse_effect("EXY:poly2", context.chain))
    scene = scene_of(first, [shape])
    teeth = teeth_of(scene, scene.candidates[0])
    shortest, travel = pitch_limits(context)["Y"]
    if steps == 5:
        assert shortest == np.inf
        assert teeth is None
    else:
        assert shortest == pytest.approx(60.0)
        assert teeth is not None
        assert travel / teeth._teeth.max() > shortest
        assert teeth._grid.shapes[:, 0].min() >= shortest - 0.01
