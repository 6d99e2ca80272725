"""Mistakes of units and lengths that still can be read are told; no example raises a false alarm."""

from __future__ import annotations

import csv
import math
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

from monitor.readers import doubts, read_campaign
from monitor.readers.doubts.axes_doubts import mistaken_axes
from monitor.readers.doubts.doubts import result_doubts
from monitor.readers.doubts.unit_doubts import runs_in_units
from monitor.records import Campaign
from monitor.workflow.intake.gross_doubts import gross_doubts
from tests.discovery.laser_along_x import laser_along_x

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
Change = Callable[[float], float]


def of(folder: Path) -> tuple[str, ...]:
    campaign = read_campaign(folder)
    assert isinstance(campaign, Campaign)
    return doubts(campaign)


@pytest.fixture
def altered(tmp_path: Path) -> Callable[..., Path]:
    """An example with the columns of ``probings.csv`` changed by functions, and text of ``campaign.toml`` replaced."""

    def alter(example: str, columns: dict[str, Change] | None = None, *texts: tuple[str, str]) -> Path:
        folder = tmp_path / example
        shutil.copytree(EXAMPLES / example, folder)
        with (folder / "probings.csv").open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        for row in rows:
            for name, change in (columns or {}).items():
                row[name] = f"{change(float(row[name])):.9f}"
        with (folder / "probings.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)
        toml = (folder / "campaign.toml").read_text(encoding="utf-8")
        for old, new in texts:
            assert old in toml
            toml = toml.replace(old, new)
        (folder / "campaign.toml").write_text(toml, encoding="utf-8")
        return folder

    return alter


@pytest.mark.parametrize(
    "example", sorted(path.parent.name for path in EXAMPLES.glob("*/probings.csv")), ids=str
)
def test_no_example_raises_a_doubt(example: str) -> None:
    assert of(EXAMPLES / example) == ()


def metres(value: float) -> float:
    return value / 1000.0


def test_all_linear_columns_in_metres(altered: Callable[..., Path]) -> None:
    spans, distances = of(altered("cold-cold", dict.fromkeys(("x_mm", "y_mm", "z_mm"), metres)))
    assert "x_mm, z_mm and y_mm span" in spans or "x_mm, y_mm and z_mm span" in spans
    assert "is the unit mm? Readings in metres look like this" in spans
    assert "0.001 times the declared ones" in distances
    assert "as if x_mm, y_mm and z_mm were in metres" in distances


def test_one_column_in_metres(altered: Callable[..., Path]) -> None:
    (told,) = of(altered("five-days", {"y_mm": metres}))
    assert "it looks as if y_mm was in metres" in told


def test_readings_in_inches(altered: Callable[..., Path]) -> None:
    (told,) = of(altered("five-days", dict.fromkeys(("x_mm", "y_mm", "z_mm"), lambda mm: mm / 25.4)))
    assert "were in inches" in told


def test_an_artefact_in_metres(altered: Callable[..., Path]) -> None:
    told = of(
        altered(
            "five-days", None,
            ("[118.0, 6.0, 178.8]", "[0.118, 0.006, 0.1788]"),
            ("[-4.0, 121.0, 153.4]", "[-0.004, 0.121, 0.1534]"),
            ("[-117.0, -8.0, 102.6]", "[-0.117, -0.008, 0.1026]"),
            ("[9.0, -119.0, 77.2]", "[0.009, -0.119, 0.0772]"),
            ("[-150.0, 152.494615, 60.0]", "[-0.15, 0.152494615, 0.06]"),
            ("[-150.0, -152.494615, 60.0]", "[-0.15, -0.152494615, 0.06]"),
        )
    )  # fmt: skip
    assert "or the declared places in another unit than mm" in told[0]
    assert "but its balls S1 and S2 are declared 0.3049892 mm apart" in told[1]


def test_statements_of_another_unit(altered: Callable[..., Path]) -> None:
    probe, ball, bar = of(
        altered(
            "five-days", None,
            ("standard_uncertainty_um = 1.0", "standard_uncertainty_um = 0.001"),
            ("6.0, 178.8]\ndiameter_mm = 19.05", "6.0, 178.8]\ndiameter_mm = 19050"),
            ("standard_uncertainty_mm = 0.0012", "standard_uncertainty_mm = 1.2"),
        )
    )  # fmt: skip
    assert "is 0.001 µm: is standard_uncertainty_um in µm?" in probe
    assert "ball 1 has a diameter of 19050 mm" in ball
    assert "is 1.2 mm, more than a thousandth" in bar


def test_the_uncertainty_of_an_angle_is_named_by_its_own_key(altered: Callable[..., Path]) -> None:
    """It was called the probe's 0.005 µm, of a key that the file does not have."""
    stated = ("standard_uncertainty_urad = 5.0", "standard_uncertainty_urad = 0.005")
    told = of(altered("mount-mmt-2023-07", None, stated))
    assert [line for line in told if "standard_uncertainty" in line] == [
        "setup stars: standard_uncertainty_urad is 0.005: is it in µrad?"
    ]


@pytest.mark.parametrize(
    ("example", "column"), [("cold-cold", "b_deg"), ("five-days", "c_deg"), ("tilting-table", "a_deg")]
)
def test_radians_in_one_column(altered: Callable[..., Path], example: str, column: str) -> None:
    (told,) = of(altered(example, {column: math.radians}))
    assert f"{column} never exceeds" in told
    assert "is the unit degree?" in told


def test_radians_of_a_robot(altered: Callable[..., Path]) -> None:
    joints = dict.fromkeys([f"j{k}_deg" for k in range(1, 7)], math.radians)
    (told,) = of(altered("tracked-robot", joints))
    assert "j1_deg, j2_deg, j3_deg, j4_deg, j5_deg and j6_deg never exceed" in told


def test_an_angle_that_begins_anew_at_180_degrees(altered: Callable[..., Path]) -> None:
    """A log of a mount prints -177.9 for 182.1: another way that the axis turned, and another answer."""
    (told,) = of(altered("mount-gem-28", {"dec_deg": lambda angle: angle - 360.0 * (angle > 180.0)}))
    assert "dec_deg goes from 178.694 to -179.616" in told
    assert "if the axis went on past 180 there, its angles span 206.3 degrees and not 359.7" in told
    assert "add 360 to those below -12.09" in told


def test_an_axis_that_turned_to_and_fro_over_a_turn_did_not_begin_anew(altered: Callable[..., Path]) -> None:
    assert of(altered("mount-gem-28", {"ha_deg": lambda angle: 2.0 * angle - 180.0})) == ()


def test_two_passes_over_a_whole_turn_are_no_angles_that_begin_anew(altered: Callable[..., Path]) -> None:
    """360, and 0 for the next pass: the table turned back."""
    quarters = iter([0.0, 90.0, 180.0, 270.0, 360.0] * 1000)
    told = of(altered("mount-gem-28", {"ha_deg": lambda _: next(quarters)}))
    assert not any("goes from" in sentence for sentence in told)


def test_a_tracker_in_metres(altered: Callable[..., Path]) -> None:
    (told,) = of(altered("tracked-robot", dict.fromkeys([f"tracker_{k}_mm" for k in "xyz"], metres)))
    assert "tracker_x_mm, tracker_y_mm and tracker_z_mm span" in told


def test_modules_in_another_place(altered: Callable[..., Path]) -> None:
    told = of(altered("l-shape", dict.fromkeys(("x_mm", "y_mm", "z_mm"), metres)))
    assert "the distances between modules that were probed are 0.001 times" in told[-1]


def test_a_run_that_was_broken_off(tmp_path: Path) -> None:
    folder = tmp_path / "broken"
    shutil.copytree(EXAMPLES / "five-days", folder)
    lines = (folder / "probings.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    (folder / "probings.csv").write_text("".join(lines[:-10]), encoding="utf-8")
    (told,) = of(folder)
    assert told.startswith("run 20 has 52 probings, 19 others have 62")


def test_days_that_are_hours() -> None:
    campaign = read_campaign(EXAMPLES / "five-days")
    start = campaign.runs[0].started_at
    runs = tuple(
        replace(run, started_at=start + timedelta(minutes=30 * i)) for i, run in enumerate(campaign.runs)
    )
    (doubt,) = doubts(replace(campaign, runs=runs))
    assert doubt.startswith("days 1 and 2 (from runs 1 and 5 on) began on 20")
    assert doubt.endswith("so give run 5 day 1 in runs.csv")
    assert "(4 of 4 such): are the numbers in the column day those of days?" in doubt


def in_inches_in_run_2(folder: Path) -> Path:
    """The folder with the lengths of run 2 in inches."""
    path = folder / "probings.csv"
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        for name in ("x_mm", "y_mm", "z_mm"):
            if row["run"] == "2":
                row[name] = f"{float(row[name]) / 25.4:.6f}"
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return folder


@pytest.mark.parametrize("example", ["five-days", "tilting-table"])
def test_one_run_in_inches_is_said_as_that_and_no_reading_of_it_is_called_wrong(
    altered: Callable[..., Path], example: str
) -> None:
    campaign = read_campaign(in_inches_in_run_2(altered(example)))
    assert isinstance(campaign, Campaign)
    (sentence,) = doubts(campaign)
    assert sentence == (
        "run 2: x_mm, y_mm and z_mm span 0.03937 times the span in the other runs, as if they were in inches there; "
        "lengths are in mm"
    )
    assert gross_doubts(campaign) == ()
    (odd,) = runs_in_units(campaign)
    assert odd.ratio == pytest.approx(1.0 / 25.4, rel=1e-3)


@pytest.mark.parametrize(("divided_by", "named"), [(1.0, []), (25.4, [3])])
def test_a_run_that_was_broken_off_is_none_in_another_unit(
    tmp_path: Path, divided_by: float, named: list[int]
) -> None:
    """Was: "ten times too small" by the import of a run that ended at 50 of 500 mm, and no certificate of any run;
    `explain` and `identify` named no run in inches that has few rows."""
    whole = [50.0 * number for number in range(11)]
    few = [
        position / divided_by for position in (whole[:2] if divided_by == 1.0 else whole[::4] + whole[-1:])
    ]
    campaign, _ = laser_along_x(tmp_path / "laser", [whole, whole, few], lambda x: 0.0, 1)
    assert [odd.run for odd in runs_in_units(campaign)] == named
    told = [doubt for doubt in result_doubts(campaign) if doubt.startswith("run 3: x_mm spans")]
    assert len(told) == len(named)


def test_a_whole_file_in_inches_makes_no_row_a_gross_reading(altered: Callable[..., Path]) -> None:
    folder = altered("free-form-pocket", dict.fromkeys(("x_mm", "y_mm"), lambda mm: mm / 25.4))
    campaign = read_campaign(folder)
    assert isinstance(campaign, Campaign)
    (sentence,) = doubts(campaign)
    assert sentence.startswith(
        "the distances between points that were probed are 0.0394 times the declared ones"
    )
    assert "in inches" in sentence
    assert gross_doubts(campaign) == ()


def test_runs_with_a_copied_moment_are_named() -> None:
    campaign = read_campaign(EXAMPLES / "five-days")
    assert isinstance(campaign, Campaign)

    def copied(*numbers: int) -> str:
        """What is said where runs state the moment of run 2."""
        moment = campaign.runs[1].started_at
        runs = [replace(run, started_at=moment) if run.run in numbers else run for run in campaign.runs]
        (sentence,) = doubts(replace(campaign, runs=tuple(runs)))
        return sentence

    of_all = len(campaign.runs)
    assert re.match(
        rf"runs 2 and 3 state the same started_at, \d{{4}}-\d\d-\d\d \d\d:\d\d \(2 of {of_all} runs share",
        copied(3),
    )
    assert copied(3).endswith(
        "Correct started_at in runs.csv: warm-up of the day, drifts and trends count from it"
    )
    assert copied(3, 4).startswith("runs 2, 3, ... state the same started_at")


def test_a_run_that_is_still_to_come_is_named_with_what_to_do(altered: Callable[..., Path]) -> None:
    folder = altered("tilting-table")
    runs = folder / "runs.csv"
    lines = runs.read_text(encoding="utf-8").splitlines()
    lines[4] = lines[4].replace(",20", ",21", 1)
    runs.write_text("\n".join(lines) + "\n", encoding="utf-8")
    (sentence,) = of(folder)
    assert re.match(
        r"run 4 started at 21\d\d-\d\d-\d\d \d\d:\d\d, which is still to come \(1 of 4 runs\)", sentence
    )
    assert "correct started_at in runs.csv" in sentence


def arranged(folder: Path, change: Callable[[float, float, float], tuple[float, float, float]]) -> Path:
    """The folder with X, Y and Z of every row of ``probings.csv`` changed together."""
    names = ("x_mm", "y_mm", "z_mm")
    with (folder / "probings.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        x, y, z = (float(row[name]) for name in names)
        row.update({name: f"{value:.9f}" for name, value in zip(names, change(x, y, z), strict=True)})
    with (folder / "probings.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return folder


@pytest.mark.parametrize("example", ["five-days", "free-form-pocket"])
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda x, y, z: (y, x, z), "only with x_mm and y_mm exchanged"),
        (lambda x, y, z: (z, y, x), "only with x_mm and z_mm exchanged"),
        (lambda x, y, z: (z, x, y), "only with x_mm, y_mm and z_mm exchanged"),
        (
            lambda x, y, z: (x, -y, z),
            r"only with the other sign of y_mm: check the sign of \[machine\.axes\.Y\]",
        ),
    ],
)
def test_exchanged_columns_are_named_at_import(
    altered: Callable[..., Path],
    example: str,
    change: Callable[[float, float, float], tuple[float, float, float]],
    words: str,
) -> None:
    folder = arranged(altered(example), change)
    (doubt,) = of(folder)
    assert re.search(words, doubt)


@pytest.mark.parametrize(
    ("change", "columns"),
    [
        (lambda x, y, z: (y, x, z), "x_mm and y_mm"),
        (lambda x, y, z: (z, y, x), "x_mm and z_mm"),
        (lambda x, y, z: (x, z, y), "y_mm and z_mm"),
        (lambda x, y, z: (y, z, x), "x_mm, y_mm and z_mm"),
    ],
)
def test_exchanged_columns_of_faces_are_named_by_their_normals(
    altered: Callable[..., Path],
    change: Callable[[float, float, float], tuple[float, float, float]],
    columns: str,
) -> None:
    (doubt,) = of(arranged(altered("tilting-table"), change))
    assert f"the 23 steps between touches of one face lie in that face only with {columns} exchanged" in doubt


def test_faces_that_fit_two_exchanges_name_the_axes_of_both(altered: Callable[..., Path]) -> None:
    """One face touched along one line: who exchanged X and Y may as well have exchanged X and Z."""
    campaign = read_campaign(arranged(altered("tilting-table"), lambda x, y, z: (y, x, z)))
    probings = campaign.probings
    rows = np.array([name.startswith("side2") for name in probings.target])
    one_face = replace(
        probings,
        **{name: getattr(probings, name)[rows] for name in ("run", "sequence", "time", "target")},
        readings={name: values[rows] for name, values in probings.readings.items()},
        channels={name: values[rows] for name, values in probings.channels.items()},
    )
    mistaken = mistaken_axes(replace(campaign, probings=one_face))
    assert mistaken is not None
    assert (mistaken.axes, mistaken.count) == ("XYZ", 3)


@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
def test_a_sign_is_no_mistake_where_the_machine_file_states_it(
    altered: Callable[..., Path], axis: str
) -> None:
    column = {f"{axis.lower()}_mm": lambda value: -value}
    # The readings and their statement together are right, either alone is not.
    folder = altered("five-days", column, (f"{axis} = {{ sign = 1 }}", f"{axis} = {{ sign = -1 }}"))
    assert of(folder) == ()
    shutil.copy(EXAMPLES / "five-days" / "probings.csv", folder / "probings.csv")
    (doubt,) = of(folder)
    assert f"only with the other sign of {axis.lower()}_mm" in doubt


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        (
            "pressure_hPa",
            101325.0,
            "pressure_hPa is 101325 in run 1 .* outside 500 to 1100\\): is the unit hPa?",
        ),
        ("pressure_hPa", 1.013, "pressure_hPa is 1.013 .* is the unit hPa?"),
        ("humidity_percent", 0.45, "humidity_percent is 0.45 .* outside 1 to 100\\): is the unit percent?"),
        ("humidity_percent", 450.0, "humidity_percent is 450 .* is the unit percent?"),
        ("pressure_hPa", 620.0, None),
        ("pressure_hPa", math.nan, None),
    ],
)
def test_air_of_no_shop_is_told(name: str, value: float, said: str | None) -> None:
    campaign = read_campaign(EXAMPLES / "laser")
    assert isinstance(campaign, Campaign)
    runs = tuple(replace(run, conditions={**run.conditions, name: value}) for run in campaign.runs)
    told = [text for text in doubts(replace(campaign, runs=runs)) if text.startswith(name)]
    assert len(told) == (said is not None)
    assert said is None or re.search(said, told[0])
