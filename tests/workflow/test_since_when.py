"""Since when: the fleet says of each row when it began, as a count of the runs by hand does."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from monitor.store import Database, save_analysis
from monitor.store.events import record_event
from monitor.workflow.fleet.attention import Attention, Onset
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from tests.store.test_fleet import START, keep

WEEKS = 14


@pytest.fixture
def db(tmp_path: Path):
    with Database(tmp_path / "monitor.duckdb") as db:
        yield db


def _fill(db: Database, machine: str, levels: list[float], limit: float = 0.0) -> list[datetime]:
    """Campaigns of three runs with scatter 0.1 about these levels, in µm/m; return when each began (UTC)."""
    rng = np.random.default_rng([5, len(machine), ord(machine[0])])
    for number, level in enumerate(levels):
        keep(db, machine, [(level + 0.1 * rng.normal(size=3)).tolist()], f"{machine}-{number}")
    if limit:
        db.execute(
            "UPDATE imported_campaign SET machine_description = ? WHERE machine = ?",
            [f'{{"tolerances": {{"EXX": {limit}}}}}', machine],
        )
    rows = db.rows(
        "SELECT min(started_at) FROM run JOIN campaign USING (campaign_id) WHERE machine = ? GROUP BY campaign_id "
        "ORDER BY 1",
        [machine],
    )
    return [began.replace(tzinfo=UTC) for (began,) in rows]


def _row(db: Database, machine: str):
    return next(row for row in fleet(db, FleetRequest(None, 0)).table if row.machine == machine)


def test_out_of_tolerance_without_an_event_has_the_date_of_the_first_run_beyond(db: Database) -> None:
    # Beyond in the third week, back, beyond for good from the ninth: negative, so that the absolute value counts.
    levels = [1.0, 1.0, -9.0, 1.0, 1.0, 1.0, 1.0, 1.0, *[-9.0] * 6]
    began = _fill(db, "silent", levels, limit=5.0)
    row = _row(db, "silent")
    assert (row.attention, row.onset_is) == (Attention.OUT, Onset.BEYOND)
    assert row.onset == began[8].isoformat()
    assert row.since is None


def test_an_event_that_brings_nothing_back_does_not_move_the_date(db: Database) -> None:
    began = _fill(db, "crashed", [1.0] * 8 + [9.0] * 6, limit=5.0)
    record_event(db, "crashed", began[10] - timedelta(hours=1), "repair", "looked at the scale")
    row = _row(db, "crashed")
    assert (row.attention, row.onset) == (Attention.OUT, began[8].isoformat())


def test_a_last_run_within_its_limit_leaves_the_latest_day(db: Database) -> None:
    for number in range(WEEKS):
        values = [1.0, 1.1, 0.9] if number < WEEKS - 1 else [9.0, 9.1, 4.0]
        keep(db, "mixed", [values], f"mixed-{number}")
    db.execute('UPDATE imported_campaign SET machine_description = \'{"tolerances": {"EXX": 5.0}}\'')
    row = _row(db, "mixed")
    assert (row.attention, row.onset_is) == (Attention.OUT, Onset.LATEST)


def test_a_step_without_an_event_is_dated_by_the_split_that_explains_most(db: Database) -> None:
    levels = [0.0] * 9 + [3.0] * 5
    began = _fill(db, "stepped", levels)
    row = _row(db, "stepped")
    assert (row.attention, row.onset_is) == (Attention.DAYS_DIFFER, Onset.DIFFERS)
    means = np.array(levels)
    explained = [np.ptp([means[:k].mean(), means[k:].mean()]) ** 2 * k * (14 - k) for k in range(1, 14)]
    assert row.onset == began[1 + int(np.argmax(explained))].isoformat() == began[9].isoformat()


@pytest.mark.parametrize(
    ("worst", "is_what", "number"),
    [
        ((30.0, 70.0, 40.0, 65.0, 80.0), Onset.MAPPED, 3),
        ((70.0, 40.0), Onset.LAST_MAP, 1),
        ((), None, None),
    ],
)
def test_a_volumetric_error_has_the_date_of_the_maps_that_judge_it(
    db: Database, worst: tuple[float, ...], is_what: Onset | None, number: int | None
) -> None:
    """Beyond since the first of the maps that are beyond without a break; runs without a map are passed over."""
    began = _fill(db, "mapped", [1.0] * 6)
    db.execute('UPDATE imported_campaign SET machine_description = \'{"tolerances": {"volumetric": 60.0}}\'')
    for week, error in enumerate(worst):
        # The run was mapped before, by a model that was wrong: the map that was stored last counts.
        for um in (500.0 - error, error):
            document = {"worst": {"error_um": um}}
            save_analysis(db, "volumetric map", document, method="guf", campaign=f"mapped-{week}", run=1)
    row = next(row for row in fleet(db, FleetRequest(None, 0)).table if row.parameter == "volumetric error")
    assert row.onset_is is is_what
    assert row.onset == (None if number is None else began[number].isoformat())
    assert row.latest_at == (began[len(worst) - 1].isoformat() if worst else None)
    assert row.latest == (worst[-1] if worst else None)


def test_what_is_as_usual_holds_since_the_last_event_or_the_first_run(db: Database) -> None:
    first = _fill(db, "quiet", [1.0] * 6)
    began = _fill(db, "repaired", [1.0] * 6)
    at = began[2] - timedelta(hours=2)
    record_event(db, "repaired", at, "repair", "ball screw changed")
    quiet, repaired = _row(db, "quiet"), _row(db, "repaired")
    assert (quiet.onset_is, quiet.onset) == (Onset.FIRST, first[0].isoformat())
    assert repaired.onset_is is Onset.EVENT
    assert datetime.fromisoformat(repaired.onset) == at
    assert first[0] > START
