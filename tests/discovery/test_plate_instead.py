"""A part that warms up on the machine that measures it, clamped at a corner: by numpy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import Explanation, explain
from monitor.effects import parse_effect
from monitor.exceptions import EffectError
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from tests.simulator.parts_on_a_cmm import CHAIN, SETUP

# A row forth, the next one back.
HOLES = [
    (x, y)
    for number, y in enumerate(np.linspace(0.0, 420.0, 8))
    for x in np.linspace(0.0, 630.0, 10)[:: 1 if number % 2 == 0 else -1]
]
STEEL = np.array([11.5e-6, 11.5e-6])


def campaign_of(
    folder: Path, seed: int, runs: int, per_kelvin: np.ndarray, held: tuple[float, float]
) -> Path:
    """80 holes of a part that warms up by 4 K and grows so along X and Y about the place where it is held, however it
    lies under the machine."""
    rng = np.random.default_rng(seed)
    rows: list[dict[str, object]] = []
    for run in range(1, runs + 1):
        turn, shift = rng.uniform(-3.0, 3.0), rng.normal(0.0, 200.0, 2)
        c, s = np.cos(turn), np.sin(turn)
        for hole, place in enumerate(HOLES):
            warm = 4.0 * (1.0 - np.exp(-(hole + 1) / 40.0))
            u, v = np.array(place) + per_kelvin * warm * (np.array(place) - held)
            at = np.array([c * u - s * v, s * u + c * v]) + shift + rng.normal(0.0, 1.5e-3, 2)
            rows.append(
                {
                    "run": run,
                    "setup": "cmm",
                    "X": place[0],
                    "Y": place[1],
                    "Z": -20.0,
                    "plate_degC": round(20.0 + warm, 2),
                }
                | {"point_x_mm": round(at[0], 4), "point_y_mm": round(at[1], 4), "point_z_mm": None}
            )
    started = [f"2026-03-{day:02d}T20:00:00+00:00" for day in range(2, 2 + runs)]
    return CHAIN.write(folder, SETUP, rows, started=started)


def explained(folder: Path) -> Explanation:
    """What the model of such a part lacks."""
    campaign = read_campaign(folder)
    problem = campaign_method(campaign).problem_of(campaign)
    return explain(campaign, problem, "instruments", rng=np.random.default_rng(1))


@pytest.mark.parametrize(
    ("seed", "runs", "held"),
    [(21, 1, (0.0, 0.0)), pytest.param(2, 4, (0.0, 0.0), marks=pytest.mark.slow), (3, 1, (630.0, 210.0))],
)
def test_two_axes_that_grow_alike_are_the_part(
    tmp_path: Path, seed: int, runs: int, held: tuple[float, float]
) -> None:
    """The ball screws of X and Y were told to warm up, of the part nothing."""
    (missing,) = explained(campaign_of(tmp_path / "part", seed, runs, STEEL, held)).missing
    assert missing.effect.startswith("instrument:cmm:expansion(")
    assert missing.effect.endswith(")@plate_degC")
    # What is stated of the points grows less by as much: the coefficient is of the statement.
    assert 1e6 * abs(missing.amplitude) == pytest.approx(11.5, abs=2.0)
    assert {place.axis for place in missing.held} == {"X", "Y"}
    for place in missing.held:
        assert abs(place.reading - held["XY".index(place.axis)]) < 3.0 * place.u
    # That two screws grow alike is possible; held elsewhere than at reading 0 each shifts its axis besides.
    named = {rival.effect for rival in missing.rivals}
    assert {"EXX:poly1@plate_degC", "EYY:poly1@plate_degC"} <= named
    assert ({"EX0X@plate_degC", "EY0Y@plate_degC"} <= named) == (held != (0.0, 0.0))


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [101, *(pytest.param(seed, marks=pytest.mark.all_seeds) for seed in (104, 105))]
)
def test_two_axes_of_which_one_grows_twice_as_much_are_told(tmp_path: Path, seed: int) -> None:
    """A plate held at Y = 169 mm or 203 mm was told, about its middle, or as following another clock."""
    per_kelvin = np.array([12e-6, 24e-6])
    found = explained(campaign_of(tmp_path / "part", seed, 2, per_kelvin, (0.0, 0.0))).missing
    assert {effect.effect for effect in found} == {"EXX:poly1@plate_degC", "EYY:poly1@plate_degC"}
    for effect in found:
        hidden = per_kelvin["XY".index(effect.effect[1])]
        assert abs(effect.amplitude - hidden) < 3.0 * effect.u


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [700, *(pytest.param(seed, marks=pytest.mark.all_seeds) for seed in (701, 702))]
)
def test_screws_that_are_held_elsewhere_than_at_zero_are_two_axes(tmp_path: Path, seed: int) -> None:
    """Were: a plate held at Y = 868 mm beside a growth of Y, or two plates; a screw shifts its axis besides."""
    found = explained(
        campaign_of(tmp_path / "part", seed, 2, np.array([12e-6, 36e-6]), (630.0, 210.0))
    ).missing
    effects = {effect.effect: effect for effect in found}
    assert set(effects) == {f"{term}@plate_degC" for term in ("EXX:poly1", "EYY:poly1", "EX0X", "EY0Y")}
    for term, hidden in (("EXX:poly1", 12e-6), ("EYY:poly1", 36e-6)):
        effect = effects[f"{term}@plate_degC"]
        assert abs(effect.amplitude - hidden) < 3.5 * effect.u


@pytest.mark.slow
def test_axes_that_grow_each_by_its_own_stay(tmp_path: Path, seeds: Callable[[int, int], range]) -> None:
    """A screw of X alone, and two of which one grows three times as much, are no part: 17 of 20 were right."""
    right = 0
    parts = seeds(10, 3)
    for seed in parts:
        for per_kelvin, names in (
            (np.array([11.5e-6, 0.0]), {"EXX:poly1"}),
            (np.array([12e-6, 36e-6]), {"EXX:poly1", "EYY:poly1"}),
        ):
            folder = tmp_path / f"{seed}-{len(names)}"
            found = explained(campaign_of(folder, 10 + seed, 2, per_kelvin, (0.0, 0.0))).missing
            right += {effect.effect.partition("@")[0] for effect in found} == names
    assert right >= 0.8 * 2 * len(parts)


def test_a_part_grows_about_where_it_is_held(tmp_path: Path) -> None:
    """By hand: 100 mm from there a millionth is 0.1 um, and the place itself stays, however the part lies."""
    campaign = read_campaign(campaign_of(tmp_path / "part", 4, 2, 0.0 * STEEL, (0.0, 0.0)))
    context = campaign_method(campaign).problem_of(campaign).context
    text = "instrument:cmm:expansion(X=70,Y=60)@plate_degC"
    effect = parse_effect(text, context.chain)
    assert effect.text == text
    shown = effect.change.shown(context)[:, :, 0]
    x, y = np.tile(np.array(HOLES), (2, 1)).T
    assert np.linalg.norm(shown, axis=1) == pytest.approx(np.hypot(x - 70.0, y - 60.0), abs=1e-6)
    wrong = parse_effect("instrument:cmm:expansion(U=70)@plate_degC", context.chain)
    with pytest.raises(EffectError, match="there is no axis 'U'; the machine has"):
        wrong.change.shown(context)
