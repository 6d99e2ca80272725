"""Moments of requests: with an offset, or by the clock of the shop, which every question reads alike."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from monitor.exceptions import InputError
from monitor.store import Database
from monitor.workflow.events import EventRequest, event
from monitor.workflow.history.periods import Period, PeriodsRequest, periods
from monitor.workflow.history.values import ValuesRequest, values_of_machine
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
#: Its shop is five hours behind UTC.
CAMPAIGN, MACHINE = "five-days", "HU40-T"


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    with Database(tmp_path_factory.mktemp("moments") / "a.duckdb", threads=1) as db:
        import_folders(db, ImportRequest([EXAMPLES / CAMPAIGN]))
        identify(db, IdentifyRequest(CAMPAIGN))
        yield db


def starts(db: Database, **period: datetime) -> tuple[datetime, ...]:
    return values_of_machine(db, ValuesRequest(MACHINE, **period)).started_at


def test_a_moment_without_an_offset_is_by_the_clock_of_the_runs(db: Database) -> None:
    every = starts(db)
    assert every[0].utcoffset() == timedelta(hours=-5)
    for number in (1, 7, len(every) - 1):
        by_the_shop = every[number].replace(tzinfo=None)
        assert starts(db, since=by_the_shop) == every[number:]
        assert starts(db, until=by_the_shop) == every[:number]
        # Of UTC it would be another run, five hours earlier.
        assert starts(db, since=every[number]) == every[number:]
        assert trend(db, TrendRequest(MACHINE, "EB0C", since=by_the_shop)).since == every[number].isoformat()


def test_a_reference_and_periods_may_be_by_either_clock(db: Database) -> None:
    every = starts(db)
    naive = [at.replace(tzinfo=None) for at in every]
    of_trend = [
        trend(db, TrendRequest(MACHINE, "EB0C", reference=(first, last))).parameters
        for first, last in ((every[0], every[8]), (naive[0], naive[8]), (every[0], naive[8]))
    ]
    assert of_trend[0] == of_trend[1] == of_trend[2]
    asked = [
        periods(db, PeriodsRequest(MACHINE, Period(at[0], at[8]), Period(other[8], other[-1])))
        for at, other in ((every, every), (naive, naive), (every, naive))
    ]
    assert np.array_equal(asked[0].runs, (8, len(every) - 9))
    assert asdict(asked[0]) == asdict(asked[1]) == asdict(asked[2])


def test_an_empty_period_is_refused_by_either_clock(db: Database) -> None:
    every = starts(db)
    with pytest.raises(InputError, match="is empty; begin it before its end"):
        starts(db, since=every[5], until=every[5].replace(tzinfo=None))
    with pytest.raises(InputError, match="is empty; begin it before its end"):
        starts(db, since=every[5].replace(tzinfo=None), until=every[4].replace(tzinfo=None))
    with pytest.raises(InputError, match="the periods overlap"):
        periods(
            db,
            PeriodsRequest(
                MACHINE, Period(every[0], every[8]), Period(every[7].replace(tzinfo=None), every[9])
            ),
        )


def test_an_event_without_an_offset_is_by_the_clock_of_the_shop(db: Database) -> None:
    answer = event(db, EventRequest(MACHINE, "belt", datetime(2026, 3, 2, 7), "repair"))
    assert [row.happened_at for row in answer.events] == [datetime(2026, 3, 2, 12)]
    with pytest.raises(InputError, match="lies in the future"):
        event(db, EventRequest(MACHINE, "belt", datetime.now() + timedelta(days=2), "repair"))
