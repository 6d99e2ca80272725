"""A rotary table whose sign is wrong, under an R-test: simulated by numpy alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from monitor.discovery import find_reading_mistakes, fit
from monitor.methods import campaign_method
from monitor.readers import read_campaign

FILE = """format = 1
campaign = "table"
method = "instruments"
[machine]
id = "table"
[[machine.work_chain]]
name = "C"
kind = "rotary"
about = "Z"
sign = {sign}
[[setups]]
id = "sphere"
reading = "vector"
instrument = "R-test"
frame = "tool"
tool_point_mm = [0.0, 0.0, 100.0]
work_point_mm = [0.0, 0.0, 100.0]
standard_uncertainty_um = 0.2
"""


def mistakes(folder: Path, sign: int) -> list[str]:
    """What looks wrong in the file of a table that turns the work by minus its reading, its sphere 10 um off centre."""
    rng, folder = np.random.default_rng(4), folder / f"sign{sign}"
    angle = np.arange(0.0, 361.0, 10.0)
    turn = -np.radians(angle)
    vector = np.column_stack([-10.0 * np.cos(turn), -10.0 * np.sin(turn), 0.0 * turn]) + rng.normal(
        0.0, 0.2, (len(angle), 3)
    )
    folder.mkdir()
    (folder / "campaign.toml").write_text(FILE.format(sign=sign), encoding="utf-8")
    (folder / "runs.csv").write_text(
        "run,started_at,day,warm_up,ambient_degC\n1,2026-03-02T08:00:00+00:00,1,false,20.0\n",
        encoding="utf-8",
    )
    lines = [
        f"1,{row + 1},{6.0 * row:.1f},sphere,{angle[row]:.4f},{x:.3f},{y:.3f},{z:.3f}"
        for row, (x, y, z) in enumerate(vector)
    ]
    head = "run,sequence,time_s,setup,c_deg,dx_um,dy_um,dz_um"
    (folder / "probings.csv").write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    campaign = read_campaign(folder)
    maker = campaign_method(campaign).problem_of
    return [mistake.what for mistake in find_reading_mistakes(campaign, maker, fit(maker(campaign)))]


def test_the_sign_of_the_axis_is_among_what_mirrors_the_readings(tmp_path):
    """Columns exchanged, one with the other sign and an axis that turns backwards mirror a circle alike."""
    assert mistakes(tmp_path, -1) == []
    first, *others = mistakes(tmp_path, 1)
    assert first == "the sign of C were the other way round (`sign` of C in campaign.toml)"
    assert "the sign of dx_um were the other way round" in others
