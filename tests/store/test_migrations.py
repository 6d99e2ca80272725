"""Numbered SQL files: applied once, each whole or not at all, and never silently different."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

import duckdb
import pytest

from monitor import __version__
from monitor.exceptions import StoreError
from monitor.store import Database, migrations
from monitor.store.migrations import Migration, migrate, pending

pytestmark = pytest.mark.usefixtures("made_anew")

FIRST = Migration(1, "0001_first.sql", "CREATE TABLE first (a INTEGER);\nINSERT INTO first VALUES (1);\n")
SECOND = Migration(2, "0002_second.sql", "CREATE TABLE second (b INTEGER);\n")


@pytest.fixture
def connection() -> Iterator[duckdb.DuckDBPyConnection]:
    with duckdb.connect() as opened:
        yield opened


def _tables(connection: duckdb.DuckDBPyConnection) -> list[str]:
    return [
        name
        for (name,) in connection.execute("SELECT table_name FROM duckdb_tables() ORDER BY ALL").fetchall()
    ]


def test_applied_in_order_and_recorded(connection: duckdb.DuckDBPyConnection) -> None:
    assert migrate(connection, [FIRST, SECOND]) == ("0001_first.sql", "0002_second.sql")
    assert connection.execute(
        "SELECT number, name, sha256, software_version FROM schema_migration"
    ).fetchall() == [
        (1, "0001_first.sql", FIRST.sha256, __version__),
        (2, "0002_second.sql", SECOND.sha256, __version__),
    ]


def test_applied_once(connection: duckdb.DuckDBPyConnection) -> None:
    migrate(connection, [FIRST])
    assert migrate(connection, [FIRST, SECOND]) == ("0002_second.sql",)
    assert migrate(connection, [FIRST, SECOND]) == ()
    assert connection.execute("SELECT count(*) FROM first").fetchall() == [(1,)]


@pytest.mark.parametrize(
    "wrong", ["CREATE TABLE third (c INTEGER); INSERT INTO nowhere VALUES (1);", "CREATE TABLE third ("]
)
def test_failing_one_leaves_no_trace_and_is_named(connection: duckdb.DuckDBPyConnection, wrong: str) -> None:
    broken = Migration(2, "0002_broken.sql", wrong)
    with pytest.raises(StoreError, match=r"the migration 0002_broken\.sql failed and left nothing: "):
        migrate(connection, [FIRST, broken])
    assert _tables(connection) == ["first", "schema_migration"]
    assert migrate(connection, [FIRST, SECOND]) == ("0002_second.sql",)


def test_failing_first_one_leaves_an_empty_file(connection: duckdb.DuckDBPyConnection) -> None:
    with pytest.raises(StoreError, match=r"0001_broken\.sql failed"):
        migrate(connection, [Migration(1, "0001_broken.sql", "SELECT 1/0 FROM nowhere")])
    assert _tables(connection) == []


def test_one_that_ends_its_own_transaction(connection: duckdb.DuckDBPyConnection) -> None:
    sly = Migration(1, "0001_sly.sql", "CREATE TABLE first (a INTEGER); COMMIT; SELECT nonsense;")
    with pytest.raises(StoreError, match=r"0001_sly\.sql may not begin or end a transaction"):
        migrate(connection, [sly])
    assert _tables(connection) == []


def test_newer_database_is_refused(connection: duckdb.DuckDBPyConnection) -> None:
    migrate(connection, [FIRST, SECOND])
    with pytest.raises(StoreError, match=r"newer than this software: .* brought it to 0002_second\.sql"):
        pending(connection, [FIRST])


def test_edited_migration_is_refused(connection: duckdb.DuckDBPyConnection) -> None:
    migrate(connection, [FIRST])
    edited = Migration(1, FIRST.name, FIRST.sql.replace("INTEGER", "BIGINT"))
    with pytest.raises(StoreError, match=r"0001_first\.sql was edited after"):
        pending(connection, [edited])


def test_missing_migration_is_refused(connection: duckdb.DuckDBPyConnection) -> None:
    migrate(connection, [FIRST])
    with pytest.raises(StoreError, match=r"0001_first\.sql, which made this database, is missing"):
        pending(connection, [Migration(1, "0001_other.sql", FIRST.sql)])


def test_gap_in_the_numbers_is_refused(connection: duckdb.DuckDBPyConnection) -> None:
    with pytest.raises(StoreError, match=r"without a gap; there are \[1, 3\]"):
        pending(connection, [FIRST, Migration(3, "0003_third.sql", "")])


def test_database_of_something_else_is_refused(path: Path) -> None:
    with duckdb.connect(str(path)) as other:
        other.execute("CREATE TABLE wages (name VARCHAR)")
    with pytest.raises(StoreError, match="a DuckDB file of something else: it has the tables wages"):
        Database(path)


def test_checksum_is_that_of_the_text_whatever_the_line_ends() -> None:
    windows = Migration(1, FIRST.name, FIRST.sql.replace("\n", "\r\n") + "\r\n")
    assert windows.sha256 == FIRST.sha256
    assert FIRST.sha256 == hashlib.sha256(FIRST.sql.rstrip("\n").encode()).hexdigest()


def test_read_only_refuses_an_older_database(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Database(path).close()
    known = migrations.available()
    more = Migration(len(known) + 1, "9999_more.sql", "CREATE TABLE more (a INTEGER)")
    monkeypatch.setattr(migrations, "available", lambda: (*known, more))
    with pytest.raises(StoreError, match="older than this software and was opened for reading only"):
        Database(path, read_only=True)
    Database(path).close()
    with Database(path, read_only=True) as db:
        assert db.rows("SELECT count(*) FROM more") == [(0,)]


def test_refusal_names_the_database(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Database(path).close()
    monkeypatch.setattr(migrations, "available", lambda: (FIRST,))
    with pytest.raises(StoreError, match=r"o'hara ü\.duckdb: the migration 0001_campaigns\.sql"):
        Database(path)


def test_the_files_of_this_version_are_numbered_and_told_in_the_database(db: Database) -> None:
    known = migrations.available()
    assert [migration.number for migration in known] == list(range(1, len(known) + 1))
    assert db.rows("SELECT name, sha256 FROM schema_migration ORDER BY number") == [
        (migration.name, migration.sha256) for migration in known
    ]
