"""A place of a plate in another unit or with exchanged balls, and rows of a tracker in another unit, are told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.readers import doubts, read_campaign
from monitor.readers.doubts.plate_doubts import plate_doubts, tracker_doubts
from monitor.records import Array, Campaign
from tests.simulator.ball_plate import Row, plate_rows, write_plate

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def _read(folder: Path) -> Campaign:
    campaign = read_campaign(folder)
    assert isinstance(campaign, Campaign)
    return campaign


def _in_inches(columns: str) -> Callable[[Row], Row]:
    return lambda row: {
        **row, **{f"{columns}{axis}_mm": f"{float(row[f'{columns}{axis}_mm']) / 25.4:.6f}" for axis in "xyz"}
    }  # fmt: skip


@pytest.mark.parametrize(("columns", "named"), [("", "x_mm, y_mm and z_mm"), ("point_", "point_x_mm")])
def test_a_place_in_inches_is_told(tmp_path: Path, columns: str, named: str) -> None:
    change = _in_inches(columns)
    rows = [change(row) if row["setup"] == "place2" else row for row in plate_rows(1)]
    (sentence,) = plate_doubts(_read(write_plate(tmp_path / "plate", rows)))
    assert sentence.startswith(f"columns {named}")
    assert "of setup place2 in run 1 look as if they were in inches" in sentence


def test_all_places_in_inches_are_left_to_what_asks_the_whole_file(tmp_path: Path) -> None:
    rows = [_in_inches("")(row) for row in plate_rows(1)]
    assert list(plate_doubts(_read(write_plate(tmp_path / "plate", rows)))) == []


def test_two_balls_that_are_exchanged_in_one_place_are_told(tmp_path: Path) -> None:
    rows = plate_rows(2)
    stated = {row["target"]: {name: row[name] for name in row if name.startswith("point_")} for row in rows}
    exchanged = {"B1": "B25", "B25": "B1"}
    for row in rows[100:150]:
        name = exchanged.get(row["target"], row["target"])
        row.update({"target": name, **stated[name]})
    campaign = _read(write_plate(tmp_path / "plate", rows))
    (sentence,) = plate_doubts(campaign)
    assert "setup place3: in 4 rows of run 1 (sequence 101, 125, 126, 150)" in sentence
    assert "B1 and B25 were exchanged" in sentence
    assert sentence in doubts(campaign)


def test_a_plate_that_is_measured_is_not_told(tmp_path: Path) -> None:
    assert list(plate_doubts(_read(write_plate(tmp_path / "plate", plate_rows(3, noise=2e-3))))) == []


def _with_points(campaign: Campaign, change: Callable[[Array], Array]) -> Campaign:
    probings = campaign.probings
    channels = {
        name: change(values) if name.startswith("tracker_") else values
        for name, values in probings.channels.items()
    }
    return replace(campaign, probings=replace(probings, channels=channels))


@pytest.mark.parametrize(
    ("first", "factor", "words"), [(600, 25.4, "in inches"), (120, 1e3, "in metres"), (0, 25.4, "")]
)
def test_rows_of_a_tracker_in_another_unit_are_told(first: int, factor: float, words: str) -> None:
    campaign = _read(EXAMPLES / "tracked-robot")
    assert list(tracker_doubts(campaign)) == []
    at = np.arange(len(campaign.probings)) >= first
    told = list(tracker_doubts(_with_points(campaign, lambda values: np.where(at, values / factor, values))))
    # All rows in one unit are asked of the whole file.
    assert [f"as if they were {words}" in sentence for sentence in told] == ([True] if first else [])
