"""The row of a campaign's runs: written beside run, and made anew from it by migration and SQL."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import duckdb
import pytest

from monitor.records import Campaign
from monitor.store import Database, import_campaign, migrations, verify_audit, withdraw_campaign
from monitor.store.migrations import available
from monitor.store.past.campaign_runs import gather_runs, imported_campaigns, run_list_faults, run_rows
from monitor.store.past.gathering import gather
from monitor.store.past.machine_runs import machine_runs


@pytest.fixture
def filled(db: Database, make_campaign: Callable[..., Campaign]) -> Database:
    """Two campaigns of one machine and one of another."""
    for name, machine in (("one", "A"), ("two", "B"), ("three", "A")):
        import_campaign(db, make_campaign(name, machine_id=machine))
    return db


def test_the_rows_are_those_of_run(filled: Database) -> None:
    expected = filled.rows(
        "SELECT campaign_id, run, started_at, utc_offset_s, day, warm_up, conditions FROM run "
        "WHERE campaign_id IN (1, 3) ORDER BY campaign_id, run"
    )
    assert len(expected) == 4
    assert sorted(run_rows(filled, [1, 3]), key=lambda row: row[:2]) == expected
    assert run_rows(filled, []) == []


def test_machines_that_share_a_hash_are_told_apart_by_their_names(filled: Database) -> None:
    filled.execute(
        "UPDATE campaign_runs SET machine_hash = (SELECT machine_hash FROM campaign_runs WHERE campaign_id = 1)"
    )
    assert [name for _, name, _ in imported_campaigns(filled, "A")] == ["one", "three"]
    assert imported_campaigns(filled, "nobody") == []


def test_withdrawn_campaigns_keep_their_row_and_do_not_count(filled: Database) -> None:
    withdraw_campaign(filled, "one", "wrong file")
    assert {run.campaign for run in machine_runs(filled, "A")} == {"three"}
    assert [number for number, _, _ in imported_campaigns(filled, "A")] == [1, 3]
    assert verify_audit(filled).ok


def test_an_import_that_is_rolled_back_leaves_no_row(
    filled: Database, make_campaign: Callable[..., Campaign]
) -> None:
    def break_off() -> None:
        with filled.transaction():
            import_campaign(filled, make_campaign("four"))
            raise RuntimeError("broken off")

    with pytest.raises(RuntimeError, match="broken off"):
        break_off()
    assert filled.rows("SELECT campaign_id FROM campaign_runs ORDER BY ALL") == [(1,), (2,), (3,)]


@pytest.mark.parametrize("portion", [1, 2, 20_000])
def test_made_anew_from_the_rows_it_is_the_same(filled: Database, portion: int) -> None:
    before = filled.rows("SELECT * FROM campaign_runs ORDER BY ALL")
    filled.execute("DELETE FROM campaign_runs")
    gather_runs(filled, portion=portion)
    assert filled.rows("SELECT * FROM campaign_runs ORDER BY ALL") == before
    assert tuple(run_list_faults(filled, portion=portion)) == ()


def test_the_migration_makes_it_from_the_rows(filled: Database) -> None:
    filled.execute("DROP TABLE campaign_runs")
    (migration,) = (migration.sql for migration in available() if migration.number == 11)
    filled.execute(migration)
    assert verify_audit(filled).ok


@pytest.mark.parametrize("portion", [1, 2, 20_000])
def test_a_database_of_before_is_filled_by_portions(monkeypatch: pytest.MonkeyPatch, portion: int) -> None:
    monkeypatch.setattr(migrations.gathering, "gather", partial(gather, portion=portion))
    with duckdb.connect() as connection:
        migrations.migrate(connection, available()[:10])
        # A number is missing, and campaign 5 is a curve without runs.
        connection.execute(
            "INSERT INTO imported_campaign SELECT i, 'c' || i, 'M', 'samba', '{}', '{}', '{}', '', '0', "
            "TIMESTAMP '2026-01-01' FROM range(1, 6) AS r(i) WHERE i <> 3"
        )
        connection.execute(
            "INSERT INTO run SELECT i, p, run, TIMESTAMP '2026-01-01' + to_days(CAST(i AS INTEGER)), 3600, run + i, "
            "p = 1, CASE WHEN p = 1 THEN MAP {'ambient_degC': run / 10, 'a_percent': 2.0} ELSE MAP {} END "
            "FROM range(1, 5) AS r(i), (VALUES (1, 7), (2, 2)) AS s(p, run) WHERE i <> 3"
        )
        migrations.migrate(connection, available())
        rows = connection.execute(
            "SELECT * EXCLUDE (machine_hash, started_at) FROM campaign_runs ORDER BY campaign_id"
        ).fetchall()
        ((hashes, starts),) = connection.execute(
            "SELECT list(DISTINCT machine_hash), list_distinct(flatten(list(started_at))) FROM campaign_runs"
        ).fetchall()
    conditions = [{}, {"ambient_degC": 0.7, "a_percent": 2.0}]
    assert rows == [
        *((i, [2, 7], [3600.0] * 2, [2 + i, 7 + i], [False, True], conditions) for i in (1, 2, 4)),
        (5, [], [], [], [], []),
    ]
    assert len(hashes) == 1
    assert sorted(start.day for start in starts) == [2, 3, 5]
