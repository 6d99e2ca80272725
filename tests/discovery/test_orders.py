"""Balls that are touched in one fixed order at every angle of a table: simulated here with numpy alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import explain
from monitor.discovery.machine.fit import Fit, fit
from monitor.discovery.machine.separation.orders import runs_in_reversed_order
from monitor.effects import parse_effect
from monitor.methods import campaign_method
from monitor.readers import read_campaign

HEAD = """
format = 1
campaign = "ordered"
method = "rotary-probing"
[machine]
id = "H4"
topology = "w B Z b X Y t"
[probe]
id = "probe"
model = "touch probe"
standard_uncertainty_um = 1.0
tip_mm = [0.0, 0.0, -180.0]
[artefact]
id = "balls"
"""
BALL = """[[artefact.balls]]
id = "{}"
nominal_mm = [{}, {}, {}]
diameter_mm = 25.4
"""
BALLS = np.array([[160.0, 60, 0], [-40, 180, 120], [-150, 90, -60], [30, 240, -140]])
TOUCHES = np.array([[0, 1.0, 0], [0, 0, 1], [0.8, 0, 0.6], [-0.8, 0, 0.6], [0.6, 0.5, 0.62]])
ANGLES = (0.0, 30.0, 75.0, 120.0, 165.0, -150.0, -100.0, -60.0, -20.0)
#: Radius of a ball and of the tip, mm.
RADIUS = 15.7


def touched(folder: Path, *, back: int = 0, reversal: float = 0.0) -> Fit:
    """Four runs in one order and as many ``back`` as are said, with 1 µm of noise and a ``reversal`` of X in mm."""
    rng = np.random.default_rng(4)
    directions = TOUCHES / np.linalg.norm(TOUCHES, axis=1)[:, None]
    plan = [(angle, ball, way) for angle in ANGLES for ball in range(4) for way in range(5)]
    lines = ["run,sequence,time_s,target,x_mm,y_mm,z_mm,b_deg,normal_x,normal_y,normal_z"]
    for run in range(1, 5 + back):
        before, side = 0.0, 1.0
        for sequence, (angle, ball, way) in enumerate(plan if run <= 4 else plan[::-1], start=1):
            c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
            # The table turns by -B: a point of the work as the machine sees it, and a direction the other way.
            turn = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
            normal = turn.T @ directions[way]
            x, y, z = turn @ (BALLS[ball] + RADIUS * normal) + rng.normal(0.0, 1e-3) * directions[way]
            side = np.sign(x - before) if abs(x - before) > 0.01 else side
            before = x
            row = (x - side * reversal, y, z + 180.0, angle, *normal)
            numbers = ",".join(f"{number:.6f}" for number in row)
            lines.append(f"{run},{sequence},{5 * sequence},{ball + 1},{numbers}")
    balls = "".join(BALL.format(number + 1, *place) for number, place in enumerate(BALLS))
    (folder / "campaign.toml").write_text(HEAD + balls, encoding="utf-8")
    runs = "".join(f"{run},2026-03-{run:02d}T08:00:00+00:00,{run},false,20.0\n" for run in range(1, 5 + back))
    (folder / "runs.csv").write_text("run,started_at,day,warm_up,ambient_degC\n" + runs, encoding="utf-8")
    (folder / "probings.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    campaign = read_campaign(folder)
    return fit(campaign_method(campaign).problem_of(campaign))


@pytest.fixture(scope="module")
def ordered(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    """Four runs in one order."""
    return touched(tmp_path_factory.mktemp("ordered"))


@pytest.mark.parametrize(
    ("effect", "rival", "runs"),
    [
        ("EZZ:reversal", "EXX:reversal", True),
        ("EXX:reversal", "EXZ:windup20mm", True),
        # A tilt and a shift of one axis jump at the same readings in every order.
        ("EXX:reversal", "EBX:reversal", False),
        ("EXX:reversal", "EXX:poly1", False),
    ],
)
def test_which_jumps_the_reversed_order_tells_apart(
    ordered: Fit, effect: str, rival: str, runs: bool
) -> None:
    first, second = (parse_effect(text, ordered.problem.context.chain) for text in (effect, rival))
    more = runs_in_reversed_order(ordered, first, np.array([9e-3]), second)
    assert (more is not None) == runs
    assert more is None or 1 <= more <= 4


@pytest.mark.slow
def test_the_runs_that_are_said_tell_them_apart(tmp_path: Path) -> None:
    """Was: more poses between the present ones, which left the rivals of a play of X as they were."""
    told: list[set[str]] = []
    for back in (0, 1):
        folder = tmp_path / str(back)
        folder.mkdir()
        problem = touched(folder, back=back, reversal=4e-3).problem
        answer = explain(read_campaign(folder), problem, "rotary-probing", rng=np.random.default_rng(1))
        (missing,) = answer.missing
        told.append({missing.effect, *(rival.effect for rival in missing.rivals)})
        if back == 0:
            assert {runs for rival, runs in missing.separation.by_order if rival != "EBX:reversal"} == {1}
    assert all("EXX:reversal" in each for each in told)
    of_other_axes = [{text for text in each if ":reversal" in text and text[2] != "X"} for each in told]
    assert of_other_axes[0]
    assert not of_other_axes[1]
