"""Rows of zeros among the points of a grid: `identify` and `explain` name them alike."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.readers import read_campaign
from monitor.readers.doubts.blank_rows import blank_rows
from monitor.store import Database
from monitor.workflow.explain.explain import explain
from monitor.workflow.explain.request import ExplainRequest
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.intake.importing import ImportRequest, import_folders
from tests.methods.test_plates_on_a_cmm import LYING, STANDING_XZ, STANDING_YZ, campaign_of

GRID = """format = 1
campaign = "grid"
method = "instruments"

[machine]
id = "mill"
topology = "w X Y b Z t"

[[setups]]
id = "cmm"
reading = "point"
standard_uncertainty_um = 1.5
known = ["targets", "scale"]
"""


def grid(folder: Path, zeros: tuple[int, ...]) -> Path:
    """A part of 80 holes that a CMM measured in a frame of its own; some rows hold ``zeros``."""
    rng = np.random.default_rng(1)
    x, y = (axis.ravel() for axis in np.meshgrid(70.0 * np.arange(10), 60.0 * np.arange(8)))
    points = np.stack([150.0 + x, -90.0 + y], axis=1) + rng.normal(0.0, 1.5e-3, (80, 2))
    points[list(zeros)] = 0.0
    folder.mkdir()
    (folder / "campaign.toml").write_text(GRID, encoding="utf-8")
    (folder / "runs.csv").write_text(
        "run,started_at,day,warm_up,ambient_degC\n1,2026-06-01T08:00:00+00:00,1,false,20.0\n",
        encoding="utf-8",
    )
    lines = ["run,sequence,time_s,setup,x_mm,y_mm,z_mm,point_x_mm,point_y_mm"]
    lines += [
        f"1,{row + 1},{12 * row},cmm,{x[row]:.3f},{y[row]:.3f},-20.000,{points[row, 0]:.4f},{points[row, 1]:.4f}"
        for row in range(80)
    ]
    (folder / "probings.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder


@pytest.mark.slow
def test_identify_and_explain_name_the_same_rows(tmp_path: Path) -> None:
    """`identify` refused the readings, and `explain` said that nothing is missing, without a word of zeros."""
    named = r"un 1, sequence 5, 6: all that was read is 0"
    with Database(tmp_path / "zeros.duckdb") as db:
        import_folders(db, ImportRequest([grid(tmp_path / "grid", (4, 5))]))
        with pytest.raises(DataError, match=named):
            identify(db, IdentifyRequest("grid"))
        assert "R" + named in explain(db, ExplainRequest("grid")).explanation.answer


def test_one_point_at_the_origin_is_a_reading(tmp_path: Path) -> None:
    assert blank_rows(read_campaign(grid(tmp_path / "grid", (4,)))) == frozenset()
    assert blank_rows(read_campaign(grid(tmp_path / "two", (4, 5)))) == {(1, 5), (1, 6)}


def test_a_bad_reading_at_the_home_pose_is_no_row_of_zeros(tmp_path: Path) -> None:
    """Was: that all axes are 0 there, as programs write where they got no reading; a plan may pass there twice."""
    table = grid(tmp_path / "grid", ()) / "probings.csv"
    head, *lines = table.read_text(encoding="utf-8").splitlines()
    for number, off in ((20, 0.0), (60, 0.06)):
        cells = lines[number].split(",")
        lines[number] = ",".join([*cells[:4], "0.000", "0.000", "0.000", f"{150.0 + off:.4f}", "-90.0000"])
    table.write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    with Database(tmp_path / "home.duckdb") as db:
        import_folders(db, ImportRequest([table.parent]))
        answer = explain(db, ExplainRequest("grid")).explanation
    assert [reading.sequence for reading in answer.suspect_data] == [61]
    assert "leave these rows out" not in answer.answer


def test_rows_in_which_axes_read_nothing_of_balls_at_stated_places_are_all_named(tmp_path: Path) -> None:
    """Was: of three rows of zeros the one of the plate's origin alone, whose stated place is 0, 0, 0."""
    table = grid(tmp_path / "grid", (0, 40)) / "probings.csv"
    head, *lines = table.read_text(encoding="utf-8").splitlines()
    for number in (0, 1, 2):
        cells = lines[number].split(",")
        lines[number] = ",".join([*cells[:4], "0.000", "0.000", "0.000", *cells[7:], f"B{number}"])
    lines[3:] = [f"{line},B{number}" for number, line in enumerate(lines[3:], start=3)]
    table.write_text("\n".join([f"{head},target", *lines]) + "\n", encoding="utf-8")
    assert blank_rows(read_campaign(table.parent)) == {(1, 1), (1, 2), (1, 3)}


@pytest.mark.slow
def test_the_origin_of_a_plate_stays_where_a_column_is_mistaken(tmp_path: Path) -> None:
    """Was: its three readings were to be left out, and no word of the inches."""
    table = campaign_of(tmp_path / "plate", [LYING, STANDING_XZ, STANDING_YZ], 1, "0.00000") / "probings.csv"
    head, *lines = table.read_text(encoding="utf-8").splitlines()
    rows = [line.split(",") for line in lines]
    origin = [float(cell) for cell in rows[0][7:9]]
    for cells in rows:
        cells[4] = f"{float(cells[4]) / 25.4:.6f}"
        of_ball = zip(cells[7:9], origin, strict=True)
        cells[7:9] = [f"{float(cell) - at + 0.0:.5f}" for cell, at in of_ball]
    table.write_text("\n".join([head, *map(",".join, rows)]) + "\n", encoding="utf-8")
    assert len(blank_rows(read_campaign(table.parent))) == 3
    with Database(tmp_path / "plate.duckdb") as db:
        import_folders(db, ImportRequest([table.parent]))
        with pytest.raises(DataError, match="It looks as if x_mm was in inches") as refusal:
            identify(db, IdentifyRequest("cmm"))
    assert "leave these rows out" not in str(refusal.value)


@pytest.mark.slow
def test_rows_of_zeros_and_a_mistaken_column_are_both_named(tmp_path: Path) -> None:
    """Was: "did not converge" alone, since the readings fit neither without the zeros nor with x in mm."""
    table = grid(tmp_path / "grid", (4, 5, 6)) / "probings.csv"
    head, *lines = table.read_text(encoding="utf-8").splitlines()
    rows = [line.split(",") for line in lines]
    for cells in rows:
        cells[4] = f"{float(cells[4]) / 25.4:.6f}"
    table.write_text("\n".join([head, *map(",".join, rows)]) + "\n", encoding="utf-8")
    with Database(tmp_path / "grid.duckdb") as db:
        import_folders(db, ImportRequest([table.parent]))
        with pytest.raises(DataError, match="sequence 5, 6, 7: all that was read is 0") as refusal:
            identify(db, IdentifyRequest("grid"))
    assert "It looks as if x_mm was in inches" in str(refusal.value)
