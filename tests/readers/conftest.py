"""A small sound campaign folder in format 1, and a way to spoil one place of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from monitor.exceptions import CampaignError, Fault
from monitor.readers import method_rules, read_campaign
from monitor.readers.method_rules import MethodRules

TOML = """\
format = 1
campaign = "small"
method = "samba"

[machine]
id = "M1"
topology = "w C B X b Z Y (C1) t"

[machine.axes.X]
sign = -1
stroke_mm = [-300.0, 300.0]
scale_pitch_mm = 0.02

[machine.axes.B]
stroke_deg = [-100.0, 100.0]

[machine.tolerances]
EC0Y = 20.0
EXX = 15

[probe]
id = "probe-1"
model = "touch-trigger probe"
standard_uncertainty_um = 0.7
tip_mm = [0.0, 0.1, -150.0]

[artefact]
id = "a ball and a bar"

[[artefact.balls]]
id = "1"
nominal_mm = [118.0, 6.0, 178.8]
diameter_mm = 19.05

[[artefact.balls]]
id = "S1"
nominal_mm = [-150.0, 152.494615, 60.0]
diameter_mm = 19.05

[[artefact.balls]]
id = "S2"
nominal_mm = [-150.0, -152.494615, 60.0]
diameter_mm = 19.05

[artefact.scale_bar]
balls = ["S1", "S2"]
length_mm = 304.98923
standard_uncertainty_mm = 0.0012
certificate = "bar certificate 2016-04"
expansion_coefficient_per_K = 11.5e-6
reference_temperature_degC = 20
"""

RUNS = """\
run,started_at,day,warm_up,ambient_degC,humidity_percent
1,2026-03-02T08:37:06.421766-05:00,1,false,22.08,41
2,2026-03-02T09:50:41-05:00,1,true,22.29,
"""

PROBINGS = """\
run,sequence,time_s,target,x_mm,y_mm,z_mm,b_deg,c_deg,c1_deg,x_axis_degC
1,1,0.0,1,191.060674,93.016712,26.519621,-60,-235,0,21.536
1,2,60.0,1,181.305767,-72.530157,-7.036789,0,-135,0,21.561
1,3,120.0,1,51.730164,-91.168911,115.032892,0,0,90,
1,4,180.0,S1,-150.1,152.4,60.1,0,0,0,21.6
1,5,240.0,S2,-150.1,-152.4,60.1,0,0,0,21.6
2,1,0.0,1,191.060675,93.016713,26.519622,-60,-235,0,21.536
2,2,60.0,1,181.305768,-72.530158,-7.036780,0,-135,0,21.561
2,3,120.0,1,51.730165,-91.168912,115.032893,0,0,90,21.586
2,4,180.0,S1,-150.1,152.4,60.1,0,0,0,21.6
2,5,240.0,S2,-150.1,-152.4,60.1,0,0,0,21.6
"""


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A folder without a fault: two runs, one ball, a bar."""
    folder = tmp_path / "small"
    folder.mkdir()
    for name, text in (("campaign.toml", TOML), ("runs.csv", RUNS), ("probings.csv", PROBINGS)):
        (folder / name).write_bytes(text.encode())
    return folder


@pytest.fixture
def spoil(small: Path) -> Callable[..., Path]:
    """Replace one piece of text, which must be there exactly once, in one file; returns the folder."""

    def replaced(file: str, old: str, new: str) -> Path:
        text = (small / file).read_bytes().decode()
        assert text.count(old) == 1, f"{old!r} stands {text.count(old)} times in {file}"
        (small / file).write_bytes(text.replace(old, new).encode())
        return small

    return replaced


@pytest.fixture
def faults_of() -> Callable[[Path], tuple[Fault, ...]]:
    """The faults that a folder is refused for."""

    def refused(folder: Path) -> tuple[Fault, ...]:
        with pytest.raises(CampaignError, match="was refused, nothing of it was kept") as caught:
            read_campaign(folder)
        return caught.value.faults

    return refused


@pytest.fixture(autouse=True)
def loose(monkeypatch):
    """A plug-in's method that asks nothing of a folder beyond what every folder must hold."""
    monkeypatch.setitem(method_rules(), "loose", MethodRules("loose"))
