"""Every single cell, view, comment and table that somebody alters is seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from monitor.readers import read_campaign
from monitor.records import Campaign, CurveCampaign
from monitor.store import (
    Database,
    LackOfFit,
    StoredIdentification,
    bookkeeping,
    clear_refusals,
    import_campaign,
    import_curve,
    record_event,
    record_refusal,
    save_analysis,
    save_identification,
    save_machine_model,
    save_selection,
    verify_audit,
    withdraw_campaign,
    withdraw_event,
)

#: A database of which these were altered is not opened (test_migrations).
SEEN_AT_OPENING = {"schema_migration.number", "schema_migration.name", "schema_migration.sha256"}

#: Another value of each type. A list is altered by turning it round with one more element.
_OTHER = {
    "VARCHAR": "concat({0}, 'x')",
    "JSON": "'{{\"altered\": 1}}'",
    "INTEGER": "{0} + 1000",
    "BIGINT": "{0} + 1000",
    "DOUBLE": "{0} + 0.001",
    "TIMESTAMP": "{0} + INTERVAL 1 HOUR",
    "BOOLEAN": "NOT {0}",
    "BLOB": "'x'::BLOB",
    "VARCHAR[]": "list_append({0}, 'x')",
    "DOUBLE[]": "list_append({0}, 1.0)",
    "BIGINT[]": "list_append({0}, 7)",
    "INTEGER[]": "list_append({0}, 7)",
    "TIMESTAMP[]": "list_append({0}, TIMESTAMP '2020-01-01')",
    "BOOLEAN[]": "list_append({0}, true)",
    "MAP(VARCHAR, DOUBLE)": "MAP {{'x': 1.0}}",
    "MAP(VARCHAR, VARCHAR)": "MAP {{'x': 'y'}}",
}


EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture
def all_tables(
    something_of_everything: Database,
    make_campaign: Callable[..., Campaign],
    make_identification: Callable[..., StoredIdentification],
) -> Database:
    """A database with a row in every table."""
    db = something_of_everything
    three = make_campaign("three")
    import_campaign(db, three, ("looks like inches",))
    identification = replace(
        make_identification(three), refers_to={"EA0B": "the axis C"}, lack_of_fit=LackOfFit(0.25)
    )
    save_identification(db, identification)
    save_analysis(db, "trend", {"a": 1}, method="guf", machine=three.machine.id)
    withdraw_campaign(db, "two", "wrong balls")
    number = record_event(
        db, three.machine.id, datetime(2026, 2, 1, tzinfo=UTC), "crash", "of another machine"
    )
    withdraw_event(db, three.machine.id, number, "of another machine")
    curve = read_campaign(EXAMPLES / "load-cell")
    assert isinstance(curve, CurveCampaign)
    import_curve(db, curve)
    record_refusal(db, "folder", ["no runs.csv"], campaign="four", machine=three.machine.id)
    clear_refusals(db, "folder", "four")
    save_selection(db, "three", "first", "run = 1", [1])
    save_machine_model(db, three.machine.id, "samba", ("samba", 1), "it has no B")
    return db


def _columns(db: Database) -> list[tuple[str, str, str]]:
    return db.rows(
        "SELECT table_name, column_name, data_type FROM duckdb_columns() JOIN duckdb_tables() USING (table_name) "
        "WHERE NOT duckdb_columns.internal ORDER BY ALL"
    )


@pytest.mark.slow
def test_every_column_of_every_table_is_verified(
    all_tables: Database, seeds: Callable[[int, int], range]
) -> None:
    """A cell of each column is altered, alone; `make test` takes every eighth column, `make trials` all."""
    db = all_tables
    assert verify_audit(db).faults == ()
    names = {table: db.rows(f'SELECT count(*) FROM "{table}"') for table, _, _ in _columns(db)}
    assert [table for table, count in names.items() if count == [(0,)]] == [], "fill them above"
    unseen, empty = set(), set()
    step = 16 // len(seeds(16, 2))
    for table, column, kind in _columns(db)[5::step] if step > 1 else _columns(db):
        ((rows,),) = db.rows(f'SELECT count("{column}") FROM "{table}"')
        if not rows:
            empty.add(f"{table}.{column}")
            continue
        other = _OTHER.get(kind)
        quoted = f'"{column}"'
        change = "list_append({0}, {0}[1])" if other is None and kind.endswith("[]") else other
        assert change is not None, f"{table}.{column} is {kind}: say how it is altered"
        db.execute("BEGIN")
        try:
            db.execute(
                f'UPDATE "{table}" SET {quoted} = {change.format(quoted)} WHERE rowid = '
                f'(SELECT min(rowid) FROM "{table}" WHERE {quoted} IS NOT NULL)'
            )
            if verify_audit(db).ok:
                unseen.add(f"{table}.{column}")
        finally:
            db.execute("ROLLBACK")
    assert unseen <= SEEN_AT_OPENING
    # What no row of this database has cannot be tried; it is little.
    assert len(empty) <= 12, sorted(empty)


@pytest.mark.parametrize(
    ("sql", "fault"),
    [
        ("CREATE OR REPLACE VIEW v_parameters AS SELECT 1 AS one", "the view v_parameters was altered"),
        ("DROP VIEW v_certificates", "the view v_certificates is missing"),
        ("CREATE TABLE extra (a INTEGER)", "the table extra was not made by this software"),
        ("COMMENT ON COLUMN run.utc_offset_s IS 'Offset (h)'", "the column run.utc_offset_s was altered"),
        ("COMMENT ON TABLE run IS 'nothing'", "the table run was altered"),
        ("ALTER TABLE event ADD COLUMN more INTEGER", "the column event.more was not made by this software"),
        ("CREATE MACRO avg_of(a) AS a", "the macro avg_of was not made by this software"),
        ("CREATE SCHEMA other", "the schema other was not made by this software"),
    ],
)
def test_a_schema_that_somebody_changed_is_seen_and_named(db: Database, sql: str, fault: str) -> None:
    db.execute(sql)
    assert any(sentence.startswith(fault) for sentence in verify_audit(db).faults), verify_audit(db).faults


@pytest.mark.parametrize(
    ("table", "column", "value"),
    [
        ("schema_migration", "applied_at", "applied_at - INTERVAL 1 DAY"),
        ("schema_migration", "applied_at", "applied_at + INTERVAL 100 YEAR"),
        ("schema_migration", "software_version", "'0.0.1'"),
        ("registered_machine", "registered_at", "registered_at - INTERVAL 1 DAY"),
        ("registered_machine", "registered_at", "registered_at + INTERVAL 100 YEAR"),
        ("registered_machine", "registration", "registration + 1000"),
    ],
)
def test_when_a_schema_and_a_machine_came_is_held_by_the_next_campaign(
    db: Database, make_campaign: Callable[..., Campaign], table: str, column: str, value: str
) -> None:
    import_campaign(db, make_campaign("one"))
    assert verify_audit(db).faults == ()
    db.execute(f"UPDATE {table} SET {column} = {value} WHERE rowid = (SELECT max(rowid) FROM {table})")
    assert verify_audit(db).faults == ("campaign one was altered after it was stored",)


def test_an_entry_of_an_earlier_version_holds_the_books_of_its_own_subject(
    db: Database, make_campaign: Callable[..., Campaign], monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as earlier:
        earlier.setattr(bookkeeping, "_ROWS_OF_BEFORE", {})
        import_campaign(db, make_campaign("one"))
    assert verify_audit(db).faults == ()
    db.execute("UPDATE imported_campaign SET software_version = '0.0.1'")
    assert verify_audit(db).faults == ("campaign one was altered after it was stored",)


@pytest.mark.parametrize("table", ["schema_migration", "registered_machine"])
def test_what_comes_later_by_a_clock_that_was_put_right_accuses_no_campaign(
    db: Database, make_campaign: Callable[..., Campaign], monkeypatch: pytest.MonkeyPatch, table: str
) -> None:
    """The clock was a year ahead at the import: a migration of today looks as if it had been there before."""
    ahead = (datetime.now(UTC) + timedelta(days=400)).replace(tzinfo=None)
    with monkeypatch.context() as clock:
        clock.setattr("monitor.store.campaigns.utc_now", lambda: ahead)
        import_campaign(db, make_campaign("one"))
    later = {
        "schema_migration": "SELECT number + 1, 'later.sql', sha256, '9.0', applied_at + INTERVAL 1 DAY",
        "registered_machine": "SELECT registration + 1, machine, topology, registered_at - INTERVAL 1 DAY",
    }[table]
    db.execute(f"INSERT INTO {table} {later} FROM {table} ORDER BY 1 DESC LIMIT 1")
    assert verify_audit(db).faults == ()
    # What was there before is held all the same.
    first = {"schema_migration": "applied_at", "registered_machine": "registered_at"}[table]
    db.execute(f"UPDATE {table} SET {first} = {first} - INTERVAL 2 DAY WHERE rowid = 0")
    assert verify_audit(db).faults == ("campaign one was altered after it was stored",)
