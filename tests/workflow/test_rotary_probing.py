"""Rotary probing from folder to trend: the published repeats, and two methods on one machine."""

from __future__ import annotations

import importlib
import importlib.util
import json
import sys
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from by_path import TESTS, load

from monitor.discovery import Verdict
from monitor.store import Database
from monitor.workflow.events import EventRequest, event
from monitor.workflow.explain.compare import compare
from monitor.workflow.explain.request import CompareRequest
from monitor.workflow.history.periods import Period, PeriodsRequest, periods
from monitor.workflow.history.values import ValuesRequest, values_of_machine
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.run_statistics.request import StatisticsRequest
from monitor.workflow.run_statistics.statistics import stats
from monitor.workflow.uncertainty.evaluation import uncertainty
from monitor.workflow.uncertainty.request import UncertaintyRequest

answers = load("answers", TESTS / "answers.py")
trends = answers.trends

ROOT = Path(__file__).resolve().parents[2]
SYMBOLS = load("closed_forms", ROOT / "tests" / "methods" / "closed_forms.py").SYMBOLS
TABLE_4 = json.loads((ROOT / "tests/references/papers/ibaraki2012.json").read_text(encoding="utf-8"))[
    "table_4"
]
COMPENSATED = {"EX0A", "EY0A", "EZ0A", "EA0C"}


@pytest.fixture(scope="module")
def db(tmp_path_factory):
    with Database(tmp_path_factory.mktemp("rotary") / "x.duckdb") as own:
        for name in ("tilting-table", "tilting-table-compensated"):
            import_folders(own, ImportRequest([ROOT / "examples" / name]))
        yield own


def test_table_4_four_repeats_are_four_runs(db):
    answer = identify(db, IdentifyRequest("tilting-table"))
    for symbol, row in TABLE_4.items():
        for run, printed in zip(answer.runs, row["tests"], strict=True):
            estimate = run.parameters[SYMBOLS[symbol]]
            factor = 1.0 if row["unit"] == "um" else np.pi / 180e3 * 1e6
            assert estimate.value == pytest.approx(printed * factor, abs=0.1)


def test_table_4_only_the_z_offset_drifts(db):
    assert stats(db, StatisticsRequest("tilting-table")).drift.drifts == ("EZ0A",)


def test_table_4_compensation_moves_what_was_compensated(db):
    noon = datetime(2012, 3, 5, 12, 0, tzinfo=timezone(timedelta(hours=9)))
    event(db, EventRequest("TILT-500", "dx, dy, dz and the zero of A", noon, "compensation"))
    (pair,) = trends(db, "TILT-500")["agreement"]
    assert pair["kind"] == "event"
    assert pair["campaigns"] == ["tilting-table", "tilting-table-compensated"]
    # EA0C moved too, by 9.6 µrad; four runs before and one after it let U of the difference be 10.7 (Student, 3).
    moved = {name for name, one in pair["parameters"].items() if abs(one["difference"]) > one["expanded"]}
    assert moved == COMPENSATED - {"EA0C"}
    assert 0.8 < pair["parameters"]["EA0C"]["difference"] / pair["parameters"]["EA0C"]["expanded"] < 1.0
    assert len(pair["parameters"]) == 8
    # That is by the runs: one day on each side cannot say whether days differ by as much.
    assert pair["disagree"] == []
    assert all("measure a second day" in one["why_not_decided"] for one in pair["parameters"].values())


def test_the_block_is_explained(db):
    assert compare(db, CompareRequest("tilting-table")).comparison.verdict is Verdict.EXPLAINED


def test_uncertainty_by_both_routes(db):
    found = uncertainty(db, UncertaintyRequest("tilting-table", 1, digits=1))
    for name, u in found.guf.u.items():
        assert found.mcm.u[name] == pytest.approx(u, rel=0.05)
    assert found.mcm.not_converged == 0
    assert found.guf.budget.keys() == {"readings"}


# Two methods on one machine


TOPOLOGY = "w C B X b Z Y (C1) t"
SHARED = {"EA0B": 12e-6, "EC0B": -8e-6, "EX0C": 6e-3, "EA0C": -15e-6, "EB0C": 9e-6}


def both_methods(simulator: ModuleType, folder: Path, rotary: dict[str, float]) -> Database:
    """One machine calibrated by SAMBA with the shared errors, and a week later by rotary-probing with ``rotary``."""
    rp = importlib.import_module("simulator.rotary_probing")
    rng = np.random.default_rng(7)
    plan = simulator.five_days_plan()
    machine = simulator.SimulatedMachine(TOPOLOGY, terms=SHARED)
    schedule = simulator.working_days(rng, days=1)
    told = simulator.simulate(plan, machine, schedule, rng, noise_um=1.0)
    simulator.write_campaign(folder / "s", "by-samba", plan, machine, schedule, told, machine_id="M")
    six: dict[str, np.ndarray] = {}
    for name, value in rotary.items():
        six.setdefault(name[3:], np.zeros(6))["XYZABC".index(name[1])] = value
    touches = rp.every_pose(
        rp.block(top=(20.0, -90.0, 120.0), height=100.0),
        [{"B": b, "C": c} for b in (0.0, -60.0, 45.0) for c in (0.0, 90.0, 200.0, 290.0)],
    )
    chain = sys.modules["simulator.chain"].read_topology(TOPOLOGY)
    runs = [rp.touch(chain, touches, six, rng, noise_mm=1e-3) for _ in range(4)]
    rp.write_rotary_campaign(
        folder / "r", "by-touch", TOPOLOGY, touches, runs, machine_id="M", probe_um=1.0,
        first=datetime(2026, 3, 9, 9, 0, tzinfo=UTC),
    )  # fmt: skip
    own = Database(folder / "two.duckdb")
    import_folders(own, ImportRequest([folder / "s", folder / "r"]))
    return own


def test_two_methods_share_one_trend_and_agree(simulator, tmp_path):
    with both_methods(simulator, tmp_path, SHARED) as own:
        found = trends(own, "M")
        drawn = values_of_machine(own, ValuesRequest("M")).conditions
        ends = [f"2026-03-{day:02d}T00:00:00+00:00" for day in (1, 9, 10)]
        halves = [Period(*map(datetime.fromisoformat, pair)) for pair in (ends[:2], ends[1:])]
        compared = periods(own, PeriodsRequest("M", *halves)).conditions
    # How a touched surface lay is recorded touch by touch and is no condition of a run.
    assert [name for name in (*drawn, *compared) if name.startswith("normal_")] == []
    assert found["methods"] == ["samba", "rotary-probing"]
    (pair,) = found["agreement"]
    assert pair["kind"] == "methods"
    assert set(SHARED) == set(pair["parameters"])
    assert pair["disagree"] == []
    conditions = {one["channel"] for name in SHARED for one in found["parameters"][name]["conditions"]}
    assert "method rotary-probing" in conditions


def test_two_methods_that_disagree_are_told_apart(simulator, tmp_path):
    with both_methods(simulator, tmp_path, SHARED | {"EA0B": 40e-6}) as own:
        (pair,) = trends(own, "M")["agreement"]
    assert pair["disagree"] == ["EA0B"]
    assert pair["parameters"]["EA0B"]["difference"] == pytest.approx(28.0, abs=6.0)
