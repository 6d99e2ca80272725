"""An event between two runs of one day: page and fleet count the runs since its moment, and say the same of them."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from monitor.store import Database
from monitor.store.events import record_event
from monitor.workflow.fleet.answer import FleetTableRow
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.trend.answer import ParameterTrend
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend
from tests.store.test_fleet import keep

BEFORE, AFTER = 40.0, 5.0
RUNS = 4


@pytest.fixture
def db(tmp_path: Path) -> Iterator[Database]:
    with Database(tmp_path / "monitor.duckdb") as db:
        yield db


def _starts(db: Database, campaign: str) -> list[datetime]:
    rows = db.rows(
        "SELECT started_at FROM run JOIN campaign USING (campaign_id) WHERE campaign = ? ORDER BY 1",
        [campaign],
    )
    return [at.replace(tzinfo=UTC) for (at,) in rows]


def _both(db: Database) -> tuple[FleetTableRow, ParameterTrend]:
    """What the fleet and the page say of the one parameter of the one machine."""
    (row,) = fleet(db, FleetRequest(None, 0)).table
    return row, trend(db, TrendRequest("MILL")).parameters["EXX"]


def _days(count: int, divided: int, at: int) -> list[list[float]]:
    """Days of four runs about a level that an event changes before run ``at`` (from 0) of the day ``divided``."""
    rng = np.random.default_rng(12)
    scatter = 0.3 * rng.normal(size=(count, RUNS))
    changed = np.arange(count * RUNS).reshape(count, RUNS) >= divided * RUNS + at
    return (np.where(changed, AFTER, BEFORE) + scatter).tolist()


def _keep_weeks(db: Database, days: list[list[float]]) -> None:
    for number, values in enumerate(days):
        keep(db, "MILL", [values], f"week-{number}")


def test_of_a_last_day_that_an_event_divides_the_runs_after_it_are_the_machine_as_it_is(db: Database) -> None:
    days = _days(5, 4, 2)
    _keep_weeks(db, days)
    third = _starts(db, "week-4")[2]
    # At the very start of the third run: that run follows it.
    record_event(db, "MILL", third, "repair", "scale of X changed")
    row, page = _both(db)
    assert (row.n, row.days, row.since) == (2, 1, third.isoformat())
    assert row.latest == pytest.approx(np.mean(days[4][2:]), rel=1e-12)
    assert page.mean.latest == pytest.approx(row.latest, rel=1e-12)
    assert page.mean.latest_runs == 2
    assert page.drift.slope_per_year is row.slope_per_year is None


def test_the_days_since_an_event_are_a_part_of_one_and_those_after_it(db: Database) -> None:
    days = _days(11, 4, 3)
    _keep_weeks(db, days)
    moment = _starts(db, "week-4")[3] - timedelta(seconds=1)
    record_event(db, "MILL", moment, "repair", "scale of X changed")
    row, page = _both(db)
    assert (row.n, row.days) == (1 + 6 * RUNS, 7)
    assert row.mean == pytest.approx(np.mean([days[4][3], *np.ravel(days[5:])]), rel=1e-12)
    assert page.mean.latest == pytest.approx(row.latest, rel=1e-12)
    # Days of one run and of four have the same weight in the fleet: close, not the same.
    assert page.drift.slope_per_year == pytest.approx(row.slope_per_year, abs=0.5 * row.u_slope)
    assert abs(row.slope_per_year) < 3.0 * row.u_slope


@pytest.mark.slow
def test_days_of_a_campaign_that_warms_up_are_divided_alike(db: Database) -> None:
    days = _days(8, 5, 1)
    keep(db, "MILL", days, "all", warm=tuple(range(1, 8 * RUNS, RUNS)))
    # The first run of every day warms up: of the sixth day the second to fourth count, the event lies before these.
    moment = _starts(db, "all")[5 * RUNS + 2] - timedelta(seconds=1)
    record_event(db, "MILL", moment, "repair", "scale of X changed")
    row, page = _both(db)
    counted = [days[5][2:], days[6][1:], days[7][1:]]
    assert (row.n, row.days) == (8, 3)
    assert row.mean == pytest.approx(np.mean(np.concatenate(counted)), rel=1e-12)
    assert page.mean.latest == pytest.approx(row.latest, rel=1e-12)


@pytest.mark.slow
def test_an_event_behind_the_runs_that_count_divides_nothing(db: Database) -> None:
    # The last run of all warms up: nothing that counts followed the event before it.
    keep(db, "MILL", _days(4, 4, 0), "all", warm=(4 * RUNS,))
    record_event(db, "MILL", _starts(db, "all")[-1] - timedelta(seconds=1), "crash", "into the table")
    row, page = _both(db)
    assert (row.n, row.since) == (4 * RUNS - 1, None)
    assert page.mean.latest_runs == RUNS - 1
    assert page.mean.latest == pytest.approx(row.latest, rel=1e-12)
