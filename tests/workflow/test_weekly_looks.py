"""Weekly looks at a fleet: trend page, fleet table and weekly report say the same of the same runs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, date, datetime
from pathlib import Path

import numpy as np
import pytest
from by_path import load

from monitor.reporting.health.records import Fleet
from monitor.reporting.health.render import health_html
from monitor.reporting.weekly_notice import NoticeKind, weekly_sentence
from monitor.store import Database, record_event
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.health.weeks import week_named
from monitor.workflow.history.weekly_looks import weekly_notices
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend

synthetic = load("test_trends", Path(__file__).with_name("test_trends.py"))


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    """Three machines of two parameters over 40 weeks from 2024-01-01; one parameter steps by 8 µm in week 31."""
    rng = np.random.default_rng(11)
    with Database(tmp_path_factory.mktemp("weekly") / "m.duckdb", threads=1) as database:
        for machine in ("M-1", "M-2", "M-3"):
            values = {name: rng.normal(0.0, 1.0, (40, 4)) for name in ("EXX", "EYY")}
            if machine == "M-2":
                values["EYY"][30:] += 8.0
            synthetic.add_machine(database, machine, values)
        yield database


def test_trend_and_fleet_notice_the_same(db: Database) -> None:
    looks = weekly_notices(db)
    (noticed,) = [notice for notice in looks.notices if notice.kind is NoticeKind.PARAMETER]
    assert (noticed.machine, noticed.parameters, noticed.after, noticed.since) == (
        "M-2", ("EYY",), "2024-W30", "2024-W31",
    )  # fmt: skip
    assert noticed.size == pytest.approx(8.0, abs=0.8)
    assert noticed.week in ("2024-W31", "2024-W32", "2024-W33")
    assert (looks.weeks, looks.machines) == (40, 3)
    # Of three machines two parameters and a vector each; what was noticed lately begins anew.
    assert 7 <= looks.series <= 9
    assert looks.expected_false <= 0.05 * len(looks.notices)
    assert fleet(db, FleetRequest(weekly_looks=True)).weekly_looks == looks
    assert fleet(db, FleetRequest()).weekly_looks is None
    page = trend(db, TrendRequest("M-2", weekly_looks=True)).weekly_looks
    assert page == looks.of_machines({"M-2"})
    assert trend(db, TrendRequest("M-1", weekly_looks=True)).weekly_looks.notices == ()
    assert weekly_notices(db, week_named("2024-W30")).notices == ()


def test_the_first_page_of_the_report_says_it(db: Database) -> None:
    (noticed,) = [notice for notice in weekly_notices(db).notices if notice.kind is NoticeKind.PARAMETER]
    day = date(2024, 7, 29)
    fleet_page = Fleet(
        noticed.week, day, day, datetime(2024, 8, 5), "monitor", 0.05, (),
        noticed=((noticed.machine, weekly_sentence(noticed)),),
    )  # fmt: skip
    text = "".join(health_html(fleet_page, []))
    assert "Noticed this week under weekly looks" in text
    assert f"N{weekly_sentence(noticed)[1:]}" in text
    assert "weekly looks" not in "".join(health_html(replace(fleet_page, noticed=()), []))


def test_what_is_noticed_does_not_depend_on_later_weeks(db: Database) -> None:
    (noticed,) = [notice for notice in weekly_notices(db).notices if notice.kind is NoticeKind.PARAMETER]
    assert noticed in weekly_notices(db, week_named(noticed.week)).notices


def test_a_recorded_event_begins_anew(db: Database) -> None:
    with db.transaction():
        record_event(db, "M-2", datetime(2024, 7, 28, 12, tzinfo=UTC), "repair", "new scale of Y")
    assert weekly_notices(db).notices == ()
