"""A tracked robot from the command line: words of its own, and plain refusals of what one run cannot give."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "tracked-robot"


@pytest.fixture
def robot(typed: Any, tmp_path: Path) -> Path:
    """A database with the example alone."""
    path = tmp_path / "robot.duckdb"
    assert typed("import", str(EXAMPLE), db=path).status == 0
    return path


def test_identify_gives_eighteen_errors(typed: Any, robot: Path) -> None:
    found = typed("identify", "tracked-robot", "--json", db=robot).document
    (run,) = found["runs"]
    assert len(run["parameters"]) == 18
    assert {"EB0J2", "EB0J3", "EA0J4", "EB0J5"} <= set(run["parameters"])


def test_explain_add_and_history(typed: Any, robot: Path) -> None:
    found = typed("explain", "tracked-robot", "--json", db=robot).document
    groups = [{one["effect"], *one["indistinguishable_from"]} for one in found["missing"]]
    assert any("EBJ2:compliance@gravity" in group for group in groups)
    assert any("EAJ4:harmonic1" in group for group in groups)
    assert found["target_word"] == "reflector"
    assert found["held_out"] == "blocks of poses"
    assert "one run cannot show what varies" in found["undecided"][0]
    assert found["missing"][0]["heldout_after_um"] < found["missing"][0]["heldout_before_um"]
    told = typed("explain", "tracked-robot", db=robot).out
    assert "on held-out blocks of poses" in told
    assert "µm at the reflectors" in told
    assert "ball" not in told
    assert "one run cannot show" in told
    added = typed(
        "model",
        "add",
        "EBJ2:compliance@gravity",
        "--to",
        "tracker",
        "--as",
        "soft",
        "--campaign",
        "tracked-robot",
        db=robot,
    )
    assert added.status == 0
    assert "EBJ2:compliance@gravity" in added.out
    steps = typed("model", "history", "soft", "--campaign", "tracked-robot", "--json", db=robot).document
    before, after = steps
    assert after["rms_um"] < before["rms_um"]
    assert after["heldout_rms_um"] < before["heldout_rms_um"]


def test_compare_says_readings_and_no_ball(typed: Any, robot: Path) -> None:
    told = typed("compare", "tracked-robot", db=robot).out
    assert "verdict: something is missing" in told
    assert "readings" in told
    assert "touches" not in told
    assert "ball" not in told


def test_what_one_run_cannot_give_is_refused_plainly(typed: Any, robot: Path) -> None:
    answer = typed("stats", "tracked-robot", db=robot)
    assert (answer.status, "statistics need at least two runs" in answer.err) == (2, True)
    answer = typed("uncertainty", "tracked-robot", db=robot)
    assert (answer.status, "write --method guf" in answer.err) == (2, True)


def test_effects_of_robots_are_in_the_catalogue(typed: Any, robot: Path) -> None:
    told = typed("effects", "tracker", "--json").document
    assert "tracker:turn@run_time" in {one["effect"] for one in told["effects"]}


@pytest.mark.slow
def test_a_rehearsed_robot_tells_what_it_hides(typed: Any, tmp_path: Path) -> None:
    made = typed("simulate", "arm", "--robot", "--effect", "EBJ3:harmonic2", "--peak", "150", "--seed", "3")
    assert "arm: 1 run of 1500 probings; EBJ3:harmonic2 with a peak of 150 µm is hidden" in made.out
    db = tmp_path / "arm.duckdb"
    assert typed("import", "arm", db=db).status == 0
    found = typed("explain", "arm", "--json", db=db).document
    assert found["missing"][0]["effect"] == "EBJ3:harmonic2"
    assert found["missing"][0]["peak_um"] == pytest.approx(150.0, rel=0.1)
