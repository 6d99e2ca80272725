"""Folders of rotary-probing: what is asked of normals, points and spheres."""

from __future__ import annotations

import shutil
from math import cos, radians, sin
from pathlib import Path

import pytest

from monitor.readers import read_campaign, write_campaign
from monitor.readers.doubts.doubts import doubts

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


CENTRES = {"Kugel 1": (90.0, 0.0, 60.0), "Kugel 2": (0.0, 85.0, 75.0), "Kugel 3": (-80.0, -30.0, 50.0)}
SIDES = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@pytest.fixture
def balls(tmp_path):
    """Three balls on a turning table without errors, each touched from four sides at four angles of C; radius 14 mm."""
    rows = []
    for c in (0, 90, 180, 270):
        turn = cos(radians(c)), sin(radians(c))
        for name, centre in CENTRES.items():
            for normal in SIDES:
                x, y, z = (at + 14.0 * along for at, along in zip(centre, normal, strict=True))
                x, y = x * turn[0] - y * turn[1], x * turn[1] + y * turn[0]
                cells = (f"{value:.4f}" for value in (x, y, z))
                rows.append(
                    ",".join(
                        [
                            "1",
                            str(len(rows) + 1),
                            str(8.0 * len(rows)),
                            name,
                            *cells,
                            str(c),
                            *map(str, normal),
                        ]
                    )
                )
    head = "run,sequence,time_s,target,x_mm,y_mm,z_mm,c_deg,normal_x,normal_y,normal_z"
    (tmp_path / "probings.csv").write_text("\n".join([head, *rows]) + "\n")
    (tmp_path / "runs.csv").write_text(
        "run,started_at,day,warm_up,ambient_degC\n1,2026-03-02T08:00:00+01:00,1,false,20.0\n"
    )
    declared = "".join(
        f'[[artefact.balls]]\nid = "{name}"\nnominal_mm = {list(centre)}\ndiameter_mm = 25.0\n'
        for name, centre in CENTRES.items()
    )
    (tmp_path / "campaign.toml").write_text(
        'format = 1\ncampaign = "balls"\nmethod = "rotary-probing"\n[machine]\nid = "M"\ntopology = "w C b Y X Z t"\n'
        '[probe]\nid = "P"\nmodel = "touch"\nstandard_uncertainty_um = 0.6\n[artefact]\nid = "three"\n'
        + declared
    )
    return tmp_path


def rewritten(folder: Path, file: str, old: str, new: str, count: int = -1) -> Path:
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new, count))
    return folder


def test_balls_touched_from_their_sides_raise_no_doubt(balls):
    assert doubts(read_campaign(balls)) == ()


def test_exchanged_columns_are_seen_by_balls_touched_from_one_side(balls):
    (told,) = doubts(read_campaign(rewritten(balls, "probings.csv", "x_mm,y_mm", "y_mm,x_mm")))
    assert "steps between balls are the declared ones only with x_mm and y_mm exchanged" in told


def test_readings_of_balls_in_inches_are_seen(balls):
    head, *rows = (balls / "probings.csv").read_text().splitlines()
    for at, row in enumerate(rows):
        cells = row.split(",")
        cells[4:7] = [f"{float(cell) / 25.4:.5f}" for cell in cells[4:7]]
        rows[at] = ",".join(cells)
    (balls / "probings.csv").write_text("\n".join([head, *rows]) + "\n")
    told = doubts(read_campaign(balls))
    assert any("it looks as if x_mm, y_mm and z_mm were in inches" in sentence for sentence in told)


def test_a_misspelt_ball_is_no_point_of_a_surface(balls, faults_of):
    """It was taken for a point and told to get more names."""
    (fault,) = faults_of(rewritten(balls, "probings.csv", "Kugel 2", "Kugle 2", 1))
    assert (fault.line, fault.column) == (6, "target")
    assert fault.message == (
        "run 1: 'Kugle 2' is no ball of [[artefact.balls]]; did you mean 'Kugel 2'? "
        "As a point it was touched at one pose only"
    )


def test_calibrated_diameters_differ_in_their_last_digits(balls):
    for name, diameter in zip(CENTRES, ("25.0002", "24.9998", "25.0004"), strict=True):
        toml = balls / "campaign.toml"
        head, mark, rest = toml.read_text().partition(f'id = "{name}"')
        toml.write_text(head + mark + rest.replace("diameter_mm = 25.0\n", f"diameter_mm = {diameter}\n", 1))
    (told,) = doubts(read_campaign(rewritten(balls, "probings.csv", "x_mm,y_mm", "y_mm,x_mm")))
    assert "x_mm and y_mm exchanged" in told


def test_balls_in_one_line_say_nothing_of_exchanged_columns(balls):
    """A piece that stands turned by a right angle looks the same."""
    for name, centre, line in zip(CENTRES, CENTRES.values(), (-60.0, 0.0, 70.0), strict=True):
        rewritten(
            balls,
            "campaign.toml",
            f'{name}"\nnominal_mm = {list(centre)}',
            f'{name}"\nnominal_mm = [{line}, 0.0, 60.0]',
        )
    head, *rows = (balls / "probings.csv").read_text().splitlines()
    lines = dict(zip(CENTRES, (-60.0, 0.0, 70.0), strict=True))
    at_zero = [row.split(",") for row in rows if row.split(",")[7] == "0"]
    for cells in at_zero:
        x, y, z = CENTRES[cells[3]]
        moved = (float(cells[4]) - x, float(cells[5]) - y + lines[cells[3]], float(cells[6]) - z + 60.0)
        cells[4:7] = [f"{value:.4f}" for value in moved]
    for cells in at_zero:
        rows.append(",".join(["1", str(len(rows) + 1), str(8.0 * len(rows)), *cells[3:7], "90", *cells[8:]]))
    written = [",".join(cells) for cells in at_zero] + rows[len(at_zero) * 4 :]
    for at, row in enumerate(written):
        written[at] = ",".join(["1", str(at + 1), str(8.0 * at), *row.split(",")[3:]])
    (balls / "probings.csv").write_text("\n".join([head, *written]) + "\n")
    assert not any("exchanged" in told or "other sign" in told for told in doubts(read_campaign(balls)))
