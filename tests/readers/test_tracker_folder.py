"""Campaign folders of the method tracker: read, written, and every refusal of its own by message and line."""

# ruff: noqa: E501 (one case a line)

from __future__ import annotations

import numpy as np
import pytest

from monitor.readers import read_campaign, write_campaign
from monitor.records import Reflector
from monitor.store.record_json import artefact_json, artefact_record

TOML = """\
format = 1
campaign = "arm"
method = "tracker"
[machine]
id = "A1"
[[machine.tool_chain]]
name = "J1"
kind = "rotary"
about = "Z"
[[machine.tool_chain]]
name = "J2"
kind = "rotary"
about = "Y"
offset_mm = [0.0, 0.0, 300.0]
[probe]
id = "t"
model = "laser tracker"
standard_uncertainty_um = 20
[[artefact.reflectors]]
id = "R1"
[[artefact.reflectors]]
id = "F1"
fixed = true
"""
RUNS = "run,started_at,day,warm_up,ambient_degC\n1,2026-03-02T08:37:06Z,1,false,20\n"
HEADER = "run,sequence,time_s,target,j1_deg,j2_deg,tracker_x_mm,tracker_y_mm,tracker_z_mm,tracker_degC\n"
ROWS = [
    "1,1,0,F1,0,0,1000,2000,3000,21.0\n",
    *(f"1,{n + 2},{n + 1},R1,{10 * n},{7 * n},{100 * n}.5,{n},-3000.25,21.1\n" for n in range(5)),
]


@pytest.fixture
def arm(tmp_path):
    """A folder of five poses, without a fault."""
    folder = tmp_path / "arm"
    folder.mkdir()
    for name, text in (("campaign.toml", TOML), ("runs.csv", RUNS), ("probings.csv", HEADER + "".join(ROWS))):
        (folder / name).write_text(text)
    return folder


def test_points_and_reflectors_are_read_and_come_back(arm, tmp_path):
    campaign = read_campaign(arm)
    assert campaign.artefact.reflectors == (Reflector("R1"), Reflector("F1", fixed=True))
    assert artefact_record(artefact_json(campaign.artefact)) == campaign.artefact
    assert campaign.probings.channels["tracker_x_mm"].tolist() == [1000.0, 0.5, 100.5, 200.5, 300.5, 400.5]
    assert campaign.probings.channels["tracker_degC"][0] == 21.0
    again = read_campaign(write_campaign(campaign, tmp_path / "again"))
    assert again.artefact == campaign.artefact
    for name, values in campaign.probings.channels.items():
        np.testing.assert_array_equal(again.probings.channels[name], values)


def test_an_artefact_without_reflectors_is_stored_as_ever(arm):
    (arm / "campaign.toml").write_text(TOML[: TOML.index("[[artefact.reflectors]]")])
    assert artefact_json(read_campaign(arm).artefact) == '{"id": "", "balls": [], "scale_bar": null}'


def test_any_target_is_taken_where_no_reflector_is_listed(arm):
    (arm / "campaign.toml").write_text(TOML[: TOML.index("[[artefact.reflectors]]")])
    assert set(read_campaign(arm).probings.target.tolist()) == {"R1", "F1"}


@pytest.mark.parametrize(
    "runs", [RUNS.replace(",20\n", ",\n"), RUNS.replace(",ambient_degC", "").replace(",20\n", "\n")]
)
def test_nothing_depends_on_the_ambient_temperature(arm, tmp_path, runs):
    (arm / "runs.csv").write_text(runs)
    campaign = read_campaign(arm)
    assert campaign.runs[0].conditions == {}
    assert read_campaign(write_campaign(campaign, tmp_path / "again")).runs == campaign.runs


@pytest.mark.parametrize(
    ("file", "old", "new", "line", "column", "words"),
    [
        ("probings.csv", "tracker_z_mm", "laser_z_mm", 1, "tracker_z_mm", "missing"),
        ("probings.csv", ",-3000.25,21.1\n1,3", ",,21.1\n1,3", 3, "tracker_z_mm", "empty"),
        ("probings.csv", "100.5,1,", "nan,1,", 4, "tracker_x_mm", "nan"),
        ("probings.csv", "100.5,1,", "1e9,1,", 4, "tracker_x_mm", "is beyond 100000 mm (no stroke is given); is its unit mm?"),
        ("probings.csv", "1,3,2,R1", "1,3,2,R2", 4, "target", "there is no target 'R2'; the targets are R1, F1"),
        ("campaign.toml", "fixed = true", "fixed = 1", 23, "artefact.reflectors[2].fixed", "1 is neither true (beside the machine) nor false (on the tool)"),
        ("campaign.toml", 'id = "F1"', 'id = "R1"', 22, "artefact.reflectors[2].id", "reflector 'R1' is listed twice"),
        ("campaign.toml", 'id = "F1"', "", 21, "artefact.reflectors[2].id", "this key is missing"),
        ("campaign.toml", 'id = "R1"', 'id = "R1"\nplace_mm = [0, 0, 0]', 21, "artefact.reflectors[1].place_mm", "this key is not known; the keys here are id, fixed"),
        ("campaign.toml", 'id = "R1"', 'id = "R1"\nfixed = true', 2, "target", "run 1: no reflector on the tool was measured; measure one or more besides the fixed ones"),
        ("campaign.toml", 'id = "R1"', 'id = "R1"\n[[artefact.reflectors]]\nid = "F2"\nfixed = true', None, "artefact.reflectors", "reflector 'F2' was never measured"),
    ],
)  # fmt: skip
def test_refusals_of_the_tracker(arm, faults_of, file, old, new, line, column, words):
    text = (arm / file).read_text()
    assert text.count(old) == 1, text.count(old)
    (arm / file).write_text(text.replace(old, new))
    told = [(fault.line, fault.column, fault.message) for fault in faults_of(arm)]
    assert any(found == line and name == column and words in message for found, name, message in told), told


def test_too_few_poses_are_refused(arm, faults_of):
    (arm / "probings.csv").write_text(HEADER + "".join(ROWS[:4]))
    (fault,) = faults_of(arm)
    assert fault.message.startswith("run 1: 3 poses of the tool; frame and reflector alone take 4 or more")
