"""Every question of a machine to one with a single axis: on the side of the work, on that of the tool, or a spindle.

The readings are written here, of axes without errors: only which answers there are is asked.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from monitor.api import Database, open as opened
from monitor.discovery import explain
from monitor.exceptions import DataError
from monitor.methods.instruments.method import METHOD
from monitor.readers import read_campaign
from tests.simulator.instruments import laser

NEST = """
[[setups]]
id = "nest{height}"
reading = "vector"
frame = "tool"
instrument = "sensor nest"
standard_uncertainty_um = 0.5
tool_point_mm = [0.0, 0.0, {height}.0]
work_point_mm = [0.0, 0.0, {height}.0]
"""
AXIS = """
[[machine.{branch}_chain]]
name = "{name}"
kind = "{kind}"
{motion} = {along}
offset_mm = [0.0, 0.0, 0.0]
sign = {sign}
"""
ASKED = ("identify", "compare", "explain", "plan", "uncertainty", "statistics", "contributions")


def written(folder: Path, branch: str, kind: str) -> Path:
    """A campaign of two runs: a nest at two heights looks at what turns, a laser at what travels."""
    rng, turns = np.random.default_rng(3), kind == "rotary"
    words = {"branch": branch, "kind": kind, "sign": -1 if branch == "work" else 1}
    axis = {"name": "C", "motion": "about", "along": "[0.0, 0.0, 1.0]"}
    if not turns:
        axis = {"name": "X", "motion": "along", "along": "[1.0, 0.0, 0.0]"}
    setups = "".join(NEST.format(height=height) for height in (60, 210)) if turns else laser()
    folder.mkdir()
    (folder / "campaign.toml").write_text(
        f'format = 1\ncampaign = "{folder.name}"\nmethod = "instruments"\n[machine]\nid = "M"\n'
        f"gravity = [0.0, 0.0, -1.0]\n{AXIS.format(**words, **axis)}{setups}"
    )
    positions = np.linspace(0.0, 330.0, 12) if turns else np.linspace(0.0, 300.0, 16)
    names = ("nest60", "nest210") if turns else ("laser",)
    visited = [(name, float(place)) for name in names for place in (*positions, *positions[::-1])]
    head = "run,sequence,time_s,setup,"
    lines = [head + ("c_deg,dx_um,dy_um,dz_um" if turns else "x_mm,reading_um")]
    for run in (1, 2):
        for sequence, (name, place) in enumerate(visited, 1):
            read = rng.normal(0.0, 0.5, 3) if turns else [1e3 * place + rng.normal(0.0, 0.5)]
            numbers = ",".join(f"{each:.3f}" for each in read)
            lines.append(f"{run},{sequence},{10.0 * sequence},{name},{place},{numbers}")
    (folder / "probings.csv").write_text("\n".join(lines) + "\n")
    (folder / "runs.csv").write_text(
        "run,started_at,day,warm_up,ambient_degC\n"
        "1,2026-03-02T08:00:00+01:00,1,true,20.5\n2,2026-03-02T12:00:00+01:00,1,false,20.6\n"
    )
    return folder


@pytest.fixture
def db(tmp_path: Path) -> Iterator[Database]:
    with opened(tmp_path / "db", new=True) as database:
        yield database


@pytest.mark.slow
@pytest.mark.parametrize(("branch", "kind"), [("work", "rotary"), ("work", "linear"), ("tool", "linear")])
def test_a_machine_of_one_axis_answers_every_question(
    db: Database, tmp_path: Path, branch: str, kind: str
) -> None:
    db.add(written(tmp_path / "one", branch, kind))
    for question in ASKED:
        assert db.ask(question, campaign="one").to_dict()


def test_a_table_without_an_axis_of_the_tool_is_explained(tmp_path: Path) -> None:
    """Ended in an IndexError: the first axis of the tool was asked for."""
    campaign = read_campaign(written(tmp_path / "one", "work", "rotary"))
    told = explain(campaign, METHOD.problem_of(campaign), "instruments", rng=np.random.default_rng(1))
    assert told.missing == ()


def test_a_spindle_alone_has_no_location_and_it_is_said(db: Database, tmp_path: Path) -> None:
    """Was "values has no columns; at least one quantity is needed"."""
    db.add(written(tmp_path / "one", "tool", "rotary"))
    assert db.ask("explain", campaign="one").to_dict()["missing"] == []
    for question in ("statistics", "uncertainty"):
        with pytest.raises(DataError, match="the plan determines no parameter of the model"):
            db.ask(question, campaign="one")
