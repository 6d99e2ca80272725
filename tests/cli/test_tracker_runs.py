"""A robot measured twice in the same poses: the repeats are the yardstick, and every verb takes both runs."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from by_path import simulator
from scipy.spatial.transform import Rotation

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "tracked-robot"
NOISE = 20.0


def robots() -> ModuleType:
    """The simulator of tracked robots, loaded by path."""
    simulator()
    return importlib.import_module("simulator.robot_campaign")


def twice(folder: Path, hidden: Any, stated_um: float = NOISE) -> Path:
    """Two runs of the same poses with noise of their own, the tracker set up anew for the second."""
    made = robots()
    exact = made.track(np.random.default_rng(1), hidden, poses=80, noise_um=0.0)
    rng = np.random.default_rng(2)
    turn = Rotation.random(random_state=rng)
    again = np.round(
        turn.apply(exact.points)
        + np.array((300.0, -200.0, 90.0))
        + rng.normal(0.0, NOISE / 1e3, exact.points.shape),
        5,
    )
    first = np.round(exact.points + rng.normal(0.0, NOISE / 1e3, exact.points.shape), 5)
    made.write_tracked(folder, made.Tracked(exact.target, exact.readings, first, exact.location), stated_um)
    lines = (folder / "probings.csv").read_text().splitlines()
    for line, point in zip(lines[1:], again, strict=True):
        cells = line.split(",")
        lines.append(",".join(["2", *cells[1:-3], *(f"{value:.5f}" for value in point)]))
    (folder / "probings.csv").write_text("\n".join(lines) + "\n")
    with (folder / "runs.csv").open("a") as file:
        file.write("2,2026-03-03T08:30:00+01:00,2,false,21.6\n")
    return folder


@pytest.fixture
def database(typed: Any, tmp_path: Path) -> Path:
    """Two robots, one of which gives way under a load."""
    path = tmp_path / "two.duckdb"
    plain = twice(tmp_path / "plain", robots().Hidden(), stated_um=60.0)
    soft = twice(tmp_path / "soft", robots().Hidden(compliance={"J2": 3e-4}), stated_um=60.0)
    assert typed("import", str(plain), str(soft), db=path).status == 0
    return path


def test_repeats_are_the_yardstick_of_compare_and_explain(typed: Any, database: Path) -> None:
    """The statement is three times too large; the repeats show the model's lack of fit all the same."""
    plain = typed("compare", "plain", "--json", db=database).document
    assert plain["repeatability_um"] == pytest.approx(NOISE, rel=0.15)
    assert plain["verdict"] == "explained"
    assert plain["lack_of_fit"]["p"] > 0.01
    soft = typed("explain", "soft", "--json", db=database).document
    assert soft["repeatability_um"] == pytest.approx(NOISE, rel=0.15)
    assert soft["lack_of_fit"]["p"] < 1e-6
    assert soft["verdict"] == "something is missing"
    names = [one["effect"] for one in soft["missing"]] + soft["missing"][0]["indistinguishable_from"]
    assert "EBJ2:compliance@gravity" in names
    # Held out by whole runs now: the second is predicted from the first to its noise.
    assert soft["missing"][0]["heldout_after_um"] == pytest.approx(NOISE, rel=0.15)
    table = typed("compare", "plain", db=database).out
    assert "the worst 20 of 80; --json has all" in table


def test_statistics_and_uncertainty_of_two_runs(typed: Any, database: Path) -> None:
    found = typed("stats", "plain", "--json", db=database).document
    assert len(found["parameters"]) == 18
    assert all(one["n"] == 2 for one in found["parameters"].values())
    assert found["coordinates"]["why"] == "points seen by a tracker stand in another frame in every run"
    shown = typed("uncertainty", "plain", "--run", "2", "--method", "guf", "--json", db=database).document
    runs = typed("identify", "plain", "--json", db=database).document["runs"]
    one, two = (run["parameters"] for run in runs)
    # Two runs of one robot agree within their uncertainties.
    assert all(
        abs(one[name]["value"] - two[name]["value"]) < 4.0 * np.hypot(one[name]["u"], two[name]["u"])
        for name in one
    )
    assert set(shown["guf"]["estimate"]) == set(one)


def test_the_catalogue_of_a_robot(typed: Any, database: Path) -> None:
    folder = typed("effects", "lag", "--folder", str(EXAMPLE), "--json", db=None).document
    assert "EBJ2:lag" in {one["effect"] for one in folder["effects"]}
    assert folder["campaign"] == "tracked-robot"
    of_database = typed("effects", "--campaign", "plain", "--json", db=database).document
    names = {one["effect"] for one in of_database["effects"]}
    assert {"EBJ3:compliance@gravity", "tracker:shift@run_time", "EAJ4:harmonic2"} <= names
    assert not any(name.startswith("artefact") for name in names)
    curve = typed("effects", "--folder", str(EXAMPLE.parent / "load-cell"), "--json", db=None).document
    assert "load_N:poly2" in {one["effect"] for one in curve["effects"]}
    answer = typed("effects", "--campaign", "nobody", db=database)
    assert answer.status == 2
