"""Folders of rotary-probing: what is asked of normals, points and spheres."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from monitor.readers import read_campaign, write_campaign

EXAMPLE = Path(__file__).resolve().parents[2] / "examples/tilting-table"


@pytest.fixture
def folder(tmp_path):
    return Path(shutil.copytree(EXAMPLE, tmp_path / "t"))


def edit(folder: Path, change):
    """Change the cells of every row (a list of cells, or None to leave the row out)."""
    file = folder / "probings.csv"
    header, *rows = [line.split(",") for line in file.read_text().splitlines()]
    changed = [change(place, dict(zip(header, row, strict=True))) for place, row in enumerate(rows)]
    kept = [row for row in changed if row is not None]
    lines = [",".join(header), *(",".join(row.values()) for row in kept)]
    file.write_text("\n".join(lines) + "\n")
    return folder


def test_the_example_holds_four_runs_of_154_touches():
    campaign = read_campaign(EXAMPLE)
    assert len(campaign.probings) == 616
    assert set(campaign.probings.channels) == {"normal_x", "normal_y", "normal_z"}


def test_it_is_written_and_read_back(tmp_path):
    campaign = read_campaign(EXAMPLE)
    again = read_campaign(write_campaign(campaign, tmp_path / "again"))
    assert (again.probings.channels["normal_z"] == campaign.probings.channels["normal_z"]).all()


def test_missing_normals_are_asked_for(folder, faults_of):
    file = folder / "probings.csv"
    file.write_text("\n".join(line.rsplit(",", 1)[0] for line in file.read_text().splitlines()) + "\n")
    (fault,) = faults_of(folder)
    assert (fault.line, fault.column) == (1, "normal_z")
    assert "needs normal_x, normal_y and normal_z, the outward normal" in fault.message


def test_an_empty_normal(folder, faults_of):
    (fault,) = faults_of(edit(folder, lambda place, row: row | ({"normal_y": ""} if place == 4 else {})))
    assert (fault.line, fault.column) == (6, "normal_y")
    assert "every touch needs its normal" in fault.message


def test_a_normal_that_is_none(folder, faults_of):
    (fault,) = faults_of(edit(folder, lambda place, row: row | ({"normal_x": "0.5"} if place == 4 else {})))
    assert "has length 0.5; a normal has length 1" in fault.message


def test_two_points_of_one_name(folder, faults_of):
    found = faults_of(
        edit(
            folder, lambda place, row: row | ({"normal_y": "1"} if place == 28 and row["run"] == "1" else {})
        )
    )
    assert len(found) == 1
    assert "point 'side1-1' has another normal than on line 2" in found[0].message


def test_a_point_that_does_not_come_back(folder, faults_of):
    def keep(place, row):
        return None if row["target"] == "top-3" and row["run"] == "2" and place != 172 else row

    found = faults_of(edit(folder, keep))
    assert len(found) == 1
    assert "run 2: point 'top-3' was touched at one pose only" in found[0].message


def test_a_machine_without_rotary_axis(folder, faults_of):
    toml = folder / "campaign.toml"
    toml.write_text(toml.read_text().replace("w C A Y b X Z t", "w Y b X Z t"))
    told = [fault.message for fault in faults_of(folder)]
    assert any("has no rotary axis; the method rotary-probing" in message for message in told)


def test_a_ball_touched_too_seldom(folder, faults_of):
    toml = folder / "campaign.toml"
    toml.write_text(
        toml.read_text()
        + '\n[[artefact.balls]]\nid = "K1"\nnominal_mm = [0.0, -200.0, 170.0]\ndiameter_mm = 25.0\n'
    )
    found = faults_of(edit(folder, lambda place, row: row | ({"target": "K1"} if place == 0 else {})))
    assert any(
        "ball 'K1' was touched 1 times; a sphere of unknown centre" in fault.message for fault in found
    )
