"""Balls on a table, touched in one fixed order at every angle, by numpy alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from monitor.discovery.machine.fit import Fit, fit
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


def touched(folder: Path, *, back: int = 0, reversal: float = 0.0, drift: float = 0.0) -> Fit:
    """Four runs in one order and as many ``back`` as are said, with 1 µm of noise, a ``reversal`` of X in mm, and balls
    that shift with their table by a ``drift`` in mm along its Z within every run."""
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
            shift = drift * np.array([0.0, 0.0, sequence / len(plan)])
            x, y, z = turn @ (BALLS[ball] + shift + RADIUS * normal) + rng.normal(0.0, 1e-3) * directions[way]
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
