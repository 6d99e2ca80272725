"""Few readings: every question has the same answer, by what the readings determine and not by what the model names."""

from __future__ import annotations

import csv
import shutil
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from by_path import simulator

import monitor
from monitor.exceptions import TooFewReadingsError
from monitor.methods.instruments.method import problem_of
from monitor.methods.samba.method import problem_of as samba_problem
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.reporting.health.sentences import RunsNamed
from monitor.reporting.run_left_out import runs_left_out
from monitor.store import Database, import_campaign
from monitor.workflow.campaign_parts import without_runs
from monitor.workflow.explain.explain import explain
from monitor.workflow.explain.explain_answer import MachineExplanation
from monitor.workflow.explain.request import ExplainRequest
from monitor.workflow.health.model import model_health
from monitor.workflow.health.runs import Span
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.mistaken_columns import with_mistake
from monitor.workflow.identify.poor_runs import hardly_told, refusal_of_poor_runs
from monitor.workflow.identify.request import IdentifyRequest
from tests.discovery.virtual import as_campaign

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
QUESTIONS = ("identify", "compare", "explain", "uncertainty", "predict", "map", "contributions")
#: A tilt of the table's axis about X and Y and a squareness of X, in rad, and where the sphere stands, in mm.
TILT, SQUARENESS, SPHERE = (60e-6, -25e-6), -40e-6, np.array([80.0, 0.0, 60.0])


def _few(folder: Path, kept: tuple[int, ...], seed: int = 20261127) -> Path:
    """The example with some poses of its first run, and with the readings of the errors above (numpy alone)."""
    shutil.copytree(EXAMPLES / "r-test", folder)
    table = folder / "probings.csv"
    rows = list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))
    rows = [row for row in rows if row["run"] == "1" and int(row["sequence"]) in kept]
    noise = np.random.default_rng(seed).normal(0.0, 0.5, (len(rows), 3))
    for row, of_row in zip(rows, noise, strict=True):
        cosine, sine = np.cos(np.radians(float(row["c_deg"]))), np.sin(np.radians(float(row["c_deg"])))
        turned = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        tilted = np.array([[1.0, 0.0, TILT[1]], [0.0, 1.0, -TILT[0]], [-TILT[1], TILT[0], 1.0]])
        sphere = tilted @ turned @ SPHERE - [0.0, float(row["y_mm"]), 0.0]
        tool = np.array([float(row["x_mm"]), SQUARENESS * float(row["x_mm"]), float(row["z_mm"]) - 120.0])
        deviation = 1000.0 * (tilted @ turned).T @ (tool - sphere) + of_row
        row.update(zip(("dx_um", "dy_um", "dz_um"), (f"{value:.3f}" for value in deviation), strict=True))
    with table.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return folder


@pytest.mark.parametrize("question", QUESTIONS)
def test_three_poses_of_an_r_test(tmp_path: Path, question: str) -> None:
    with monitor.open(tmp_path / "m.duckdb", new=True) as db:
        db.add(_few(tmp_path / "r-test", (1, 6, 11)))
        with pytest.raises(
            TooFewReadingsError,
            match=r"^the 9 readings of run 1 determine as many unknowns of the model: nothing is left over to judge it "
            r"by; measure more poses$",
        ):
            db.ask(question, campaign="r-test")


def test_four_poses_have_12_readings_and_13_names(tmp_path: Path) -> None:
    """Nine are determined; what is not has no number and is named. u held in 400 of such weeks what it states."""
    with monitor.open(tmp_path / "m.duckdb", new=True) as db:
        db.add(_few(tmp_path / "r-test", (1, 6, 11, 16)))
        (run,) = db.ask("identify", campaign="r-test").runs
        assert db.ask("compare", campaign="r-test").model.startswith("instruments")
    assert run.degrees_of_freedom == 3
    truth = {"EA0C": 1e6 * TILT[0], "EB0C": 1e6 * TILT[1], "EC0X": 1e6 * SQUARENESS}
    assert set(run.parameters) == set(truth)
    for name, estimate in run.parameters.items():
        assert estimate.value == pytest.approx(truth[name], abs=3.0 * estimate.u)
        assert estimate.u < 8.0
    named = {name for refusal in run.refused for name in refusal.parameters}
    assert named == {"EX0C", "EB0Z", "EY0C", "EA0Z", "EXX", "EYY", "EZZ"}


@pytest.mark.slow
def test_a_run_that_was_broken_off_is_named_and_the_others_are_answered_without_it(tmp_path: Path) -> None:
    """Was: "measure more poses", as if nothing could be said of the four runs that have them."""
    lines = []
    for run in range(1, 6):
        poses = (1, 6, 11) if run == 5 else (1, 6, 11, 16, 3)
        table = _few(tmp_path / f"run-{run}", poses, seed=run) / "probings.csv"
        head, *rows = table.read_text(encoding="utf-8").splitlines()
        lines += [f"{run},{row.partition(',')[2]}" for row in rows]
    for name, runs in (("broken-off", 5), ("whole", 4)):
        folder = shutil.copytree(tmp_path / "run-1", tmp_path / name)
        kept = [line for line in lines if int(line.partition(",")[0]) <= runs]
        (folder / "probings.csv").write_text("\n".join([head, *kept]) + "\n", encoding="utf-8")
        head_of_runs, first, *_ = (folder / "runs.csv").read_text(encoding="utf-8").splitlines()
        dated = [f"{run},{first.partition(',')[2]}" for run in range(1, runs + 1)]
        (folder / "runs.csv").write_text("\n".join([head_of_runs, *dated]) + "\n", encoding="utf-8")
    with monitor.open(tmp_path / "m.duckdb", new=True) as db:
        db.add(tmp_path / "broken-off")
        told = db.ask("explain", campaign="r-test").explanation
        for question in [each for each in QUESTIONS if each != "explain"]:
            with pytest.raises(
                TooFewReadingsError,
                match=r"9 readings of run 5 .* or leave run 5 out: remove its rows from runs.csv and probings.csv, ",
            ):
                db.ask(question, campaign="r-test")
    with monitor.open(tmp_path / "n.duckdb", new=True) as db:
        db.add(tmp_path / "whole")
        assert len(db.ask("identify", campaign="r-test").runs) == 4
        whole = db.ask("explain", campaign="r-test").explanation
    (left_out,) = told.runs_left_out
    assert (left_out.run, left_out.readings) == (5, 9)
    assert told.answer == f"{whole.answer} {runs_left_out((left_out,))}"
    assert replace(told, answer=whole.answer, runs_left_out=None) == whole
    starts = {run: datetime(2026, 3, run) for run in range(1, 6)}
    health = model_health(told, None, Span(starts, 0, None), set())
    assert health is not None
    assert isinstance(health.runs, RunsNamed)
    assert (health.runs.count, health.runs.first, health.runs.last) == (4, starts[1], starts[4])


def test_rows_are_removed_from_the_files_that_there_are(tmp_path: Path) -> None:
    """Was: from runs.csv and probings.csv, whatever the rows came from."""
    campaign = read_campaign(_few(tmp_path / "r-test", (1, 6, 11)))
    files = tuple(replace(campaign.files[0], name=name) for name in ("cmm.toml", "1.csv", "2.csv"))
    few = TooFewReadingsError("few; measure more poses; or leave runs 2, 3 out", {2: 3, 3: 3})
    said = str(with_mistake(few, replace(campaign, files=files), problem_of))
    assert said.endswith(
        "or leave runs 2, 3 out: remove their rows from [[runs]] of cmm.toml and 1.csv, 2.csv, "
        "withdraw the campaign and import it again"
    )


@pytest.fixture(scope="module")
def cut() -> Campaign:
    """Two runs on a machine with a table and a head, of which the second ended after 30 of 58 touches: it has 90
    readings and 34 unknowns, and its head never turned."""
    sim = simulator()
    poses = [{"A": 0, "B": 0, "C1": angle} for angle in (0, 90, 180, 270)]
    poses += [{"A": angle, "B": 0, "C1": 0} for angle in (30, 60, 90, -45, -90)]
    poses += [{"A": a, "B": b, "C1": 0} for a, b in ((0, 30), (0, 60), (0, -60), (45, 45), (-45, -45))]
    plan = sim.indexed_plan("table and head", poses, bar_after=1, probe_uncertainty_um=1.0)
    schedule = sim.working_days(np.random.default_rng(0), days=1, runs_per_day=2)
    machine = sim.SimulatedMachine(
        topology="w A Y b X Z B (C1) t",
        signs=dict.fromkeys(("A", "Y", "X", "Z", "B", "C1"), 1.0),
        terms={"EXX:poly1": 18e-6, "EYY:poly1": -12e-6},
        effects=(),
        tip_mm=(0.0, 0.0, -150.0),
        down=(0.0, 0.0, -1.0),
    )
    told = sim.simulate(plan, machine, schedule, np.random.default_rng((0, 5)), noise_um=1.0)
    campaign = as_campaign(plan, machine, schedule, told, keep=(told["run"] == 1) | (told["sequence"] <= 30))
    return replace(campaign, probe=replace(campaign.probe, tip=(0.0, 0.0, -150.0)))


def test_a_run_with_more_readings_than_unknowns_but_a_poor_plan_is_named(cut: Campaign) -> None:
    """Was: "the readings contradict the machine file"."""
    refusal = refusal_of_poor_runs(cut, samba_problem)
    assert refusal is not None
    assert (refusal.by_run, refusal.undetermined) == ({2: 90}, {2: 5})
    assert str(with_mistake(refusal, cut, samba_problem)).endswith(
        "or leave run 2 out: remove its rows from runs.csv and probings.csv, withdraw the campaign and import it again"
    )
    # A file that the whole runs contradict too is no matter of the short one.
    turned = dict(cut.probings.readings) | {"A": -cut.probings.readings["A"]}
    assert (
        refusal_of_poor_runs(replace(cut, probings=replace(cut.probings, readings=turned)), samba_problem)
        is None
    )
    assert refusal_of_poor_runs(without_runs(cut, [2]), samba_problem) is None
    assert hardly_told(without_runs(cut, [2]), samba_problem) == ()
    (alone,) = hardly_told(without_runs(cut, [1]), samba_problem)
    assert "those of run 2 hardly tell 1 unknown of the model from others" in alone


@pytest.mark.slow
def test_explain_leaves_a_run_with_a_poor_plan_out(tmp_path: Path, cut: Campaign) -> None:
    with Database(tmp_path / "m.duckdb", threads=1) as db:
        import_campaign(db, cut)
        with pytest.raises(
            TooFewReadingsError, match="the 90 readings of run 2 leave 5 unknowns of the model"
        ):
            identify(db, IdentifyRequest("virtual"))
        told = explain(db, ExplainRequest("virtual")).explanation
    assert isinstance(told, MachineExplanation)
    (left_out,) = told.runs_left_out or ()
    assert (left_out.run, left_out.readings, left_out.undetermined) == (2, 90, 5)
    assert "Run 2 is left out: its 90 readings leave 5 unknowns of the model open" in told.answer
