"""`map` and `plan`: the volumetric error with its tables, and plans weighed before anyone measures."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def _rows(file: str) -> list[dict[str, str]]:
    with Path(file).open(encoding="utf-8", newline="") as text:
        return list(csv.DictReader(line for line in text if not line.startswith("#")))


@pytest.fixture
def mapped(typed: Any, filled: Path) -> Any:
    """The map of the last run of five-days, on a coarse grid."""
    return typed("map", "five-days", "--points", 3, "--json", db=filled).document


def test_map_says_worst_mean_and_expanded_uncertainty(mapped: Any) -> None:
    assert mapped["region"]["points"] == 27 * mapped["region"]["rotary_poses"]
    assert mapped["region"]["from"] == "what the campaign visited"
    assert mapped["worst"]["error_um"] > mapped["rms"]["error_um"] > mapped["mean"]["error_um"] > 0.0
    for part in (mapped["worst"], mapped["mean"], mapped["rms"], mapped["least_certain"]):
        assert part["expanded_um"] == pytest.approx(mapped["k"] * part["u_um"])
    assert mapped["least_certain"]["u_um"] > 0.0
    parts = sum(mapped["worst"]["by_parameter_um"].values())
    assert parts == pytest.approx(mapped["worst"]["error_um"], rel=1e-2)
    length = sum(value**2 for value in mapped["worst"]["vector_um"].values()) ** 0.5
    assert length == pytest.approx(mapped["worst"]["error_um"])
    assert max(one["worst_um"] for one in mapped["by_pose"]) == pytest.approx(mapped["worst"]["error_um"])


def test_map_is_stored_and_says_its_datum(typed: Any, filled: Path) -> None:
    absolute = typed("map", "five-days", "--points", 2, "--absolute", "--json", db=filled).document
    prose = typed("map", "five-days", "--points", 2, db=filled)
    assert absolute["datum"] is None
    assert "the workpiece's zero is set at" in prose.out
    assert "most of it from EX0C1" in prose.out


def test_map_writes_positioning_tables_whose_slope_is_the_gain(
    typed: Any, filled: Path, tmp_path: Path
) -> None:
    found = typed(
        "map", "five-days", "--run", 20, "--compensation", "positioning-csv", "--out", tmp_path / "t", "--json",
        db=filled,
    ).document  # fmt: skip
    gains = typed("identify", "five-days", "--run", 20, "--json", db=filled).document["runs"][0]["parameters"]
    rows = _rows(found["tables"][0])
    assert {row["axis"] for row in rows} == {"X", "Y", "Z"}
    for axis in "XYZ":
        own = [row for row in rows if row["axis"] == axis]
        for row in own:
            error = gains[f"E{axis}{axis}"]["value"] * float(row["reading_mm"]) * 1e-3
            assert float(row["error_um"]) == pytest.approx(error, abs=0.01)
            assert float(row["correction_um"]) == -float(row["error_um"])
            assert float(row["u_um"]) >= 0.0


def test_map_writes_the_volumetric_grid(typed: Any, filled: Path, tmp_path: Path) -> None:
    found = typed(
        "map",
        "five-days",
        "--points",
        2,
        "--compensation",
        "volumetric-csv",
        "--out",
        tmp_path,
        "--json",
        db=filled,
    ).document
    rows = _rows(found["tables"][0])
    assert len(rows) == found["region"]["points"]
    lengths = [sum(float(row[f"error_{axis}_um"]) ** 2 for axis in "xyz") ** 0.5 for row in rows]
    assert max(lengths) == pytest.approx(found["worst"]["error_um"], abs=1e-3)


def test_map_draws_slices(typed: Any, filled: Path, tmp_path: Path) -> None:
    found = typed("map", "five-days", "--points", 3, "--figures", tmp_path, "--json", db=filled).document
    assert [Path(file).name for file in found["figures"]] == ["volumetric-error.svg", "volumetric-error.png"]
    assert all(Path(file).stat().st_size > 1000 for file in found["figures"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("map", "five-days", "--compensation", "heidenhain"),
            "there are positioning-csv and volumetric-csv",
        ),
        (("map", "five-days", "--points", 1), "choose 2 to 41 points along each axis"),
        (("map", "five-days", "--run", 99), "no run 99"),
        (("plan", "five-days", "--balls", 25), "--balls 25: choose 1 to 24"),
        (("plan", "five-days", "--poses", 1), "--poses 1: choose 3 to 40"),
        (("plan", "five-days", "--wanted", "EA0C"), "write a parameter, = and a number"),
        (("plan", "five-days", "--wanted", "EQQ=1"), "there is no such parameter"),
        (("plan", "five-days", "--wanted", "EXX=0.001"), "reaches the wanted uncertainties"),
        (("plan", "five-days", "--separate", "EBZ:poly2"), "name two effects with a comma"),
        (("uncertainty", "five-days", "--workers", 0), "at least one worker is needed"),
        (("uncertainty", "five-days", "--workers", 2, "--cluster", "tcp://h:1"), "choose one of them"),
    ],
)
def test_refusals_say_what_would_be_right(typed: Any, filled: Path, arguments: Any, message: str) -> None:
    answer = typed(*arguments, db=filled)
    assert answer.status == 2
    assert message in answer.err
    assert answer.out == ""


def test_plan_tells_what_the_present_plan_promises(typed: Any, filled: Path) -> None:
    found = typed("plan", "five-days", "--json", db=filled).document
    present = found["present"]
    assert present["probings"] == 62
    assert present["parameters"]["EA0C"]["u"] == pytest.approx(2.0, rel=0.05)
    assert present["parameters"]["EA0C"]["figure_of_merit"] == pytest.approx(1.0)
    assert all(0.0 < one["separation"] <= 1.0 for one in present["parameters"].values())
    assert found["time_model"]["from"] == "the times of this campaign"
    assert [len(row["balls"]) for row in found["by_balls"]] == [1, 2, 3, 4]
    # One of the ten that no plan with these balls sees (docs of effects).
    assert "EYX:poly1" in found["blind_spots"]
    assert "EBB:harmonic2" not in found["blind_spots"]
    assert "proposed" not in found


def test_plan_proposes_balls_and_poses_and_draws_them(typed: Any, filled: Path, tmp_path: Path) -> None:
    answer = typed("plan", "five-days", "--balls", 5, "--poses", 9, "--figures", tmp_path, db=filled)
    assert answer.status == 0
    assert "proposed: 5 balls" in answer.out
    assert "at 9 indexations" in answer.out
    assert "check on the machine that the stylus can reach them" in answer.out
    assert (tmp_path / "expected-uncertainties.svg").stat().st_size > 1000


def test_plan_finds_the_quickest_for_wanted_uncertainties(typed: Any, filled: Path) -> None:
    found = typed(
        "plan", "five-days", "--wanted", "EA0C=3", "--wanted", "EX0C1=0.6", "--json", db=filled
    ).document
    proposed = found["proposed"]
    assert proposed["parameters"]["EA0C"]["u"] <= 3.0
    assert proposed["parameters"]["EX0C1"]["u"] <= 0.6
    assert proposed["seconds"] < found["present"]["seconds"]


def test_plan_separates_what_a_pose_can_and_says_what_none_can(typed: Any, filled: Path) -> None:
    found = typed("plan", "five-days", "--separate", "EBZ:poly2,EZZ:poly2", "--json", db=filled).document[
        "separate"
    ]
    assert found["poses"]
    assert found["standard_deviations_apart"]["then"] > 5.0 > found["standard_deviations_apart"]["now"]
    never = typed(
        "plan", "five-days", "--separate", "EAC:harmonic1,EBC:harmonic1", "--json", db=filled
    ).document
    assert never["separate"]["poses"] == []
    assert never["separate"]["verdict"] == "no pose that this machine reaches tells them apart"
    plain = typed("plan", "five-days", "--separate", "EBB:harmonic2,EBB:harmonic3", db=filled)
    assert "this plan tells them apart already" in plain.out


def test_plan_for_two_names_with_a_comma_names_the_option_that_was_meant(typed: Any, tmp_path: Path) -> None:
    db = tmp_path / "instruments.duckdb"
    assert typed("import", EXAMPLES / "r-test", db=db).status == 0
    answer = typed("plan", "r-test", "--for", "EA0C,EB0C", db=db)
    assert (answer.status, answer.out) == (2, "")
    assert "--for EA0C,EB0C: it takes one parameter and may be repeated" in answer.err
    assert "are named by --separate EA0C,EB0C" in answer.err
