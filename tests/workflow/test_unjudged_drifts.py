"""A drift that no tolerance judges: told in the weekly report, before a day that chance makes in the fleet."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from by_path import load
from scipy import stats

from monitor.reporting.health.records import ChangeKind, State
from monitor.statistics.trend import trend
from monitor.store import Database
from monitor.units import DAYS_PER_YEAR
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.health.verdict import (
    Conformity,
    drifting_to_limit,
    drifting_unjudged,
    since_when,
    state_of,
)

HERE = Path(__file__)
synthetic = load("test_trends", HERE.with_name("test_trends.py"))
first_page = load("first_page", HERE.parents[1] / "reporting" / "test_first_page.py")
binding = load("binding_limit", HERE.parents[1] / "reporting" / "test_binding_limit.py")
QUIET = SimpleNamespace(suspect=())
UNLIMITED = Conformity({}, None, every_has_one=False)


def test_the_state_is_drifts_since_the_first_run_that_shows_it() -> None:
    drifting = drifting_unjudged([binding.STILL, binding.GROWN])
    assert [each.parameter for each in drifting] == ["EXX:reversal"]
    state = state_of(UNLIMITED, (), None, QUIET, 0.05, evaluated=True, drifts=bool(drifting))
    assert state is State.DRIFTS
    started = binding.GROWN.history.times[0]
    assert since_when(state, [binding.STILL, binding.GROWN], (), started) == started


def test_what_a_drift_makes_due_is_so_since_the_first_run_that_shows_it() -> None:
    """A step of another parameter is no beginning of a drift."""
    step = SimpleNamespace(kind=ChangeKind.CHANGE, at=datetime(2026, 8, 10), this_week=False)
    parameters = [binding.STILL, binding.GROWN]
    noted = (step,)
    assert since_when(State.IN_TOLERANCE, parameters, noted, step.at) == step.at
    drift = binding.GROWN.drift.since
    assert drift is not None
    assert drift != step.at
    assert since_when(State.IN_TOLERANCE, parameters, noted, step.at, binding.GROWN.name) == drift


def test_a_drift_with_a_tolerance_is_judged_by_it() -> None:
    assert not drifting_unjudged([first_page.parameter(tolerance=200.0)])
    assert not drifting_unjudged([])


def test_of_a_volumetric_error_the_drifts_are_named_that_add_to_it() -> None:
    parameters = (binding.EXX, binding.EC0Y, binding.EX0C1)
    named = drifting_to_limit(State.OUT_OF_TOLERANCE, parameters, binding.MAP, None)
    assert [each.parameter for each in named] == ["EC0Y"]


def _named(rng: np.random.Generator, parameters: int, drift: float) -> list[str]:
    """What is named of nine campaigns a month apart, two days of three runs each, days as unlike as runs; the first
    parameter drifts by ``drift`` scatters of a run a month."""
    days = np.repeat([30 * month + day for month in range(9) for day in range(2)], 3)
    t = days + np.tile([0.0, 0.1, 0.2], 18)
    histories = []
    for index in range(parameters):
        values = np.repeat(rng.normal(size=18), 3) + rng.normal(size=54)
        if index == 0:
            values = values + drift * t / 30.0
        line = trend(values, t, days=days, cycle=DAYS_PER_YEAR, robust=False)
        seen = replace(
            binding.GROWN.drift, p_value=line.p_value, per_year=line.slope * DAYS_PER_YEAR,
            u_per_year=line.u_slope * DAYS_PER_YEAR,
        )  # fmt: skip
        histories.append(replace(binding.GROWN, name=f"P{index}", drift=seen))
    return [each.parameter for each in drifting_unjudged(histories)]


@pytest.mark.slow
def test_a_machine_on_which_nothing_drifts_is_rarely_said_to(seeds) -> None:
    """At 1 % of machines of 13 parameters, as changes are; docs/reports-and-certificates.md has the rates over 500."""
    machines = seeds(500, 25)
    false = sum(bool(_named(np.random.default_rng([77100, seed]), 13, 0.0)) for seed in machines)
    # More would have a probability of 1e-4 at twice the nominal rate.
    assert false <= stats.binom.isf(1e-4, len(machines), 0.02)
    assert all("P0" in _named(np.random.default_rng([77200, seed]), 5, 3.0) for seed in machines[:8])


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory):
    """Rows of a fleet: a drift, a last day as chance makes one among 20 machines, and one that no chance makes."""
    rng = np.random.default_rng(77300)
    with Database(tmp_path_factory.mktemp("unjudged") / "fleet.duckdb") as db:
        weeks = 0.2 * np.tile([1.0, -1.0], 6)[:, np.newaxis] + np.zeros((12, 4))
        for index in range(20):
            synthetic.add_machine(
                db, f"M{index}", {"EYY": weeks + 0.02 * rng.normal(size=(12, 4))}, limit=1e3
            )
        moved = weeks.copy()
        moved[-1] += 0.95  # 3.6 standard deviations of the days from their mean
        synthetic.add_machine(db, "Chance", {"EYY": moved + 0.02 * rng.normal(size=(12, 4))}, limit=1e3)
        moved[-1] += 20.0
        synthetic.add_machine(db, "Crashed", {"EYY": moved + 0.02 * rng.normal(size=(12, 4))}, limit=1e3)
        drift = 3.0 * np.arange(12)[:, np.newaxis]
        synthetic.add_machine(
            db, "Drifting", {"EYY": drift + weeks + 0.02 * rng.normal(size=(12, 4))}, limit=1e3
        )
        rows = fleet(db, FleetRequest(top=0)).table
    return {row.machine: row for row in rows}


@pytest.mark.slow
def test_the_fleet_ranks_a_drift_before_a_day_that_chance_makes(table) -> None:
    ranks = [table[name].rank for name in ("Crashed", "Drifting", "Chance")]
    assert ranks == [1, 2, 3]
    assert [table[name].attention for name in ("Crashed", "Drifting", "Chance")] == [
        "the latest day stands out", "drifts", "the latest day stands out",
    ]  # fmt: skip
