"""How far a missing effect moves the points that were measured, beyond what the base model takes up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import fit
from monitor.discovery.machine.scene import ChainScene, scene_of
from monitor.discovery.machine.shapes.variants import variants_of
from monitor.discovery.machine.sizes import peak_of, peaks_of_errors, seen_as_turn
from monitor.effects import parse_effect
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.workflow.sight import effect_sight
from tests.simulator.instruments import SimulatedAxis, SimulatedChain

#: Length of the tool, and where X was measured, far from the zero of its scale, mm.
TOOL, PLACES = 80.0, [*np.arange(500.0, 901.0, 50.0), *np.arange(900.0, 499.0, -50.0)]
EFFECTS = ("EXX:poly1", "EXX:poly2", "EXX:poly3", "EBX:poly1", "EBX:reversal")


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> ChainScene:
    """A laser and an autocollimator along X, which carries a tool of one length."""
    return _scene(tmp_path_factory.mktemp("peaks") / "peaks", TOOL)


def _scene(folder: Path, tool: float) -> ChainScene:
    """The effects of a laser that stands ``tool`` mm below the way, and of an autocollimator."""
    ways = {"Z": (0.0, 0.0, 1.0), "X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0)}
    chain = SimulatedChain(tuple(SimulatedAxis(name, "linear", way) for name, way in ways.items()))
    laser = (
        '\n[[setups]]\nid = "laser"\nreading = "displacement"\ninstrument = "laser"\nstandard_uncertainty_um = 0.3\n'
        f'tool_point_mm = [0.0, 0.0, {-tool}]\ndirection = "X"\n'
    )
    angle = (
        '\n[[setups]]\nid = "ac"\nreading = "angle"\ninstrument = "autocollimator"\n'
        'standard_uncertainty_urad = 1.0\ntool_point_mm = [0.0, 0.0, 0.0]\ndirection = "Y"\n'
    )
    rng, rows = np.random.default_rng(3), []
    for setup, column in (("laser", "reading_um"), ("ac", "reading_urad")):
        for place in PLACES:
            read = rng.normal(0.0, 0.3) + (1e3 * place if setup == "laser" else 0.0)
            rows.append({"setup": setup, "X": place, "Y": 0.0, "Z": 0.0, column: read})
    campaign = read_campaign(chain.write(folder, laser + angle, rows))
    assert isinstance(campaign, Campaign)
    problem = campaign_method(campaign).problem_of(campaign)
    effects = [parse_effect(text, problem.context.chain) for text in EFFECTS]
    return scene_of(fit(problem), [variant for effect in effects for variant in variants_of(effect)])


def _peak_of(scene: ChainScene, text: str, size: float) -> float:
    """The peak in mm of an effect that moves something by ``size`` times its column."""
    (candidate,) = (each for each in scene.candidates if each.effect.text == text)
    return peak_of(scene, candidate, candidate.raw, np.array([size]))


def test_a_bow_is_as_high_as_it_stands_beyond_a_straight_line(scene: ChainScene) -> None:
    """Counted from the zero of the axis it would be more than five times as high."""
    (candidate,) = (each for each in scene.candidates if each.effect.text == "EXX:poly2")
    at = np.array(PLACES)
    length = candidate.raw[: len(at), 0, 0]
    bow = length - np.polyval(np.polyfit(at, length, 1), at)
    assert _peak_of(scene, "EXX:poly2", 1.0) == pytest.approx(np.abs(bow).max(), rel=1e-6)
    assert np.abs(length).max() > 5.0 * np.abs(bow).max()


def test_a_tilt_moves_the_tip_by_its_lever_whatever_measures_angles(scene: ChainScene) -> None:
    """Was: a microradian counted as a micrometre where an autocollimator took part."""
    assert _peak_of(scene, "EBX:reversal", 20e-6) == pytest.approx(20e-6 * TOOL, rel=1e-6)


@pytest.mark.parametrize("arm", [0.0, 1.0, 3.0])
def test_a_tilt_that_a_laser_does_not_see_is_as_large_as_it_turns(tmp_path: Path, arm: float) -> None:
    """Was: 0.0 µm at most, and in a rehearsal a straight line that the model takes up."""
    scene = _scene(tmp_path / "in-line", arm)
    (tilt,) = (each for each in scene.candidates if each.effect.text == "EBX:reversal")
    assert _peak_of(scene, "EBX:reversal", 20e-6) == pytest.approx(20e-6 * 1000.0, rel=1e-6)
    assert seen_as_turn(scene, tilt.raw @ np.array([20e-6]))
    sight = effect_sight(scene.fit.problem, "EBX:cyclic160mm", 5e-3)
    assert sight.words("EBX:cyclic160mm", 5.0) == ""


def test_an_error_of_several_effects_has_one_peak_of_all_of_them(scene: ChainScene) -> None:
    """A square and a cube that cancel in part: each is higher by itself than what the axis does."""
    square, cube, tilt = (
        next(each for each in scene.candidates if each.effect.text == text)
        for text in ("EXX:poly2", "EXX:poly3", "EBX:reversal")
    )
    at = np.array(PLACES)
    # Both bow alike over these places; the cube 3 times the middle as much.
    sizes = [(np.array([size]), np.eye(1)) for size in (1e-7, 20e-6, -1e-7 / 2100.0)]
    length = square.raw[: len(at), 0, 0] * 1e-7 - cube.raw[: len(at), 0, 0] * 1e-7 / 2100.0
    bow = np.abs(length - np.polyval(np.polyfit(at, length, 1), at)).max()
    peaks = peaks_of_errors(scene, (square, tilt, cube), sizes)
    assert peaks == {0: pytest.approx(bow, rel=1e-6)}
    each = [peak_of(scene, one, one.raw, size) for one, size in ((square, sizes[0][0]), (cube, sizes[2][0]))]
    assert bow < 0.2 * min(each)
