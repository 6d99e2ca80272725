"""A head whose ball stays in place: its linear axes have one place for every angle, and errors of either are rivals.

Simulated by ``tests/simulator/instruments.py``, which shares no line with the package.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import Fit, fit
from monitor.discovery.machine.scene import ChainScene, scene_of
from monitor.discovery.machine.separation.rivals import RivalSearch
from monitor.discovery.machine.separation.second_ball import second_ball
from monitor.discovery.search.amplitudes import amplitudes
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.rivals import least_likelihood
from monitor.effects import ChainEffect, parse_effect
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.records import SecondSetup
from tests.simulator.instruments import SimulatedAxis, SimulatedChain, X, Y, Z

LENGTH, STROKES = 200.0, dict.fromkeys("XYZ", (-600.0, 600.0))
BALL = """
[[setups]]
id = "ball"
reading = "vector"
instrument = "R-test"
standard_uncertainty_um = 1.0
tool_point_mm = [0.0, 0.0, -200.0]
work_point_mm = [0.0, 0.0, 0.0]
"""


@pytest.fixture(scope="module")
def head(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    """A gantry with a head B that turns from 0 to 90 degrees and back, twice; B tilts by 25 urad about 45 degrees."""
    rng = np.random.default_rng(7)
    bump = lambda b: (0.0, 0.0, 0.0, 0.0, 25e-6 * np.exp(-(((b - 45.0) / 15.0) ** 2)), 0.0)  # noqa: E731
    linear = [SimulatedAxis(name, "linear", way) for name, way in zip("XYZ", (X, Y, Z), strict=True)]
    chain = SimulatedChain((*linear, SimulatedAxis("B", "rotary", Y, motion=bump)))
    up = np.linspace(0.0, 90.0, 13)
    rows: list[dict[str, object]] = []
    for b in np.r_[up, up[::-1], up, up[::-1]].tolist():
        at = {
            "X": LENGTH * np.sin(np.deg2rad(b)),
            "Y": 0.0,
            "Z": LENGTH * np.cos(np.deg2rad(b)),
            "B": b,
        }
        seen = (chain.pose(at) @ [0.0, 0.0, -LENGTH, 1.0])[:3] + rng.normal(0.0, 1e-3, 3)
        shown = dict(zip(("dx_um", "dy_um", "dz_um"), (1e3 * seen).tolist(), strict=True))
        rows.append({"setup": "ball"} | at | shown)
    campaign = read_campaign(chain.write(Path(tmp_path_factory.mktemp("head")) / "head", BALL, rows))
    return fit(campaign_method(campaign).problem_of(campaign).for_search())


def _scene(fitted: Fit, *texts: str) -> ChainScene:
    chain = fitted.problem.context.chain
    names = (text.partition("(")[0] for text in texts)
    return scene_of(
        fitted, [Variant(name, parse_effect(text, chain)) for name, text in zip(names, texts, strict=True)]
    )


@pytest.mark.parametrize(
    ("told", "rival"), [("EBB:free(1,2,3,4,5,6)", "EBZ"), ("EBZ:free(3,4,5,6,7,8,9)", "EBB")]
)
def test_the_free_shape_of_an_axis_that_goes_with_another_is_a_rival_of_it(
    head: Fit, told: str, rival: str
) -> None:
    """Nothing turns between Z and B: both turn the tip about the same line, and Z has one place for every angle."""
    scene = _scene(head, told, f"{rival}:reversal")
    candidate = scene.candidates[0]
    estimate = amplitudes(scene, [candidate]).estimate
    least = least_likelihood(weigh_beside(scene, [candidate], [])[0])
    rivals = RivalSearch(scene, [candidate], ()).rivals(0, least, estimate)
    assert f"{rival}:free" in [each.family for each, _ in rivals]


def test_of_effects_that_are_one_at_all_poses_that_of_the_drive_leads(head: Fit) -> None:
    """A play of B turns and shifts the tip alike with one length of the tool; so little odds decide nothing else."""
    for texts in (("EXB:reversal", "EBB:reversal"), ("EBB:reversal", "EXB:reversal")):
        scene = _scene(head, *texts)
        drive, shift = weigh_beside(scene, scene.candidates, [])
        assert (drive.candidate.family, shift.candidate.family) == ("EBB:reversal", "EXB:reversal")
        assert drive.explained == pytest.approx(shift.explained, rel=1e-9)
        assert 1e-4 < drive.score - shift.score < 1e-3


def test_a_longer_tool_tells_a_turn_of_the_head_from_a_shift_of_it_and_from_a_tilt_of_z(head: Fit) -> None:
    chain = head.problem.context.chain
    turn, shift, tilt = (
        parse_effect(text, chain) for text in ("EBB:harmonic3", "EXB:harmonic3", "EBZ:free(3,4,5,6)")
    )
    assert all(isinstance(each, ChainEffect) for each in (turn, shift, tilt))
    large, small = np.array([4e-4, 2e-4]), np.array([1e-6, 0.0])
    for rival in (shift, tilt):
        assert second_ball(head, turn, large, rival, STROKES) == (SecondSetup.LONGER_STYLUS, 1)
        assert second_ball(head, turn, small, rival, STROKES) is None
