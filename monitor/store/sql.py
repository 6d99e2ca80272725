"""Runs a query of the user's own, which may read and change nothing, and lists machines and readings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import duckdb

from monitor.exceptions import InputError
from monitor.stopping import broken_off_by, checkpoint
from monitor.store.connection import Database

#: What DuckDB calls a moment with a time zone, such as ``now()``.
_ZONED = "TIMESTAMP WITH TIME ZONE"


@dataclass(frozen=True)
class QueryResult:
    """The columns of a query by name and type, and its rows; ``truncated`` where more rows were there."""

    columns: tuple[str, ...]
    types: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]
    truncated: bool


@contextmanager
def _reading(connection: duckdb.DuckDBPyConnection) -> Iterator[None]:
    connection.execute("BEGIN TRANSACTION READ ONLY")
    try:
        yield
    finally:
        connection.execute("ROLLBACK")


def run_query(db: Database, text: str, limit: int | None = None) -> QueryResult:
    """Run one SELECT, SHOW or DESCRIBE; at most ``limit`` rows.

    Raises InputError for anything else, and for what DuckDB does not understand, with its own words; StoppedError, also
    in the midst of the query, where it is taken back.
    """
    with db.connected() as connection:
        statement = _only_query(connection, text)
        with _reading(connection), broken_off_by(connection.interrupt):
            try:
                cursor = connection.execute(statement)
                columns = tuple(str(column[0]) for column in cursor.description or ())
                types = tuple(str(column[1]) for column in cursor.description or ())
                zoned = _with_zones_as_text(statement.query, columns, types)
                cursor = cursor if zoned is None else connection.execute(zoned)
                rows = cursor.fetchall() if limit is None else cursor.fetchmany(limit + 1)
            except duckdb.Error as fault:
                # A query that was broken off has no fault.
                checkpoint()
                raise InputError(f"the query cannot be answered: {fault}") from fault
    truncated = limit is not None and len(rows) > limit
    return QueryResult(columns, types, tuple(map(tuple, rows[:limit])), truncated)


def _only_query(connection: duckdb.DuckDBPyConnection, text: str) -> duckdb.Statement:
    """Return the one statement of a text that only reads. Raises InputError for any other text."""
    try:
        statements = connection.extract_statements(text)
    except duckdb.Error as fault:
        raise InputError(f"this is no SQL that DuckDB understands: {fault}") from fault
    if len(statements) != 1:
        count = f"these are {len(statements)}" if statements else "there is none"
        raise InputError(f"type one query, such as SELECT * FROM v_machines; {count}")
    # EXPLAIN ANALYZE would run what it explains.
    if statements[0].type != duckdb.StatementType.SELECT:
        raise InputError(
            "a query may only read: begin it with SELECT, WITH, FROM, SHOW, DESCRIBE or SUMMARIZE"
        )
    return statements[0]


def _with_zones_as_text(query: str, columns: Sequence[str], types: Sequence[str]) -> str | None:
    """Return a query of the same rows whose moments with a zone are texts: DuckDB's Python needs pytz for them.

    None where there are none. Raises InputError where one stands inside a list or structure.
    """
    if not any(_ZONED in kind for kind in types):
        return None
    for name, kind in zip(columns, types, strict=True):
        if _ZONED in kind and kind != _ZONED:
            raise InputError(
                f"the column {name} holds moments with a time zone inside a {kind}; write them as text or without a "
                "zone, such as CAST(moment AS TIMESTAMP)"
            )
    aliases = [f"column{number}" for number in range(len(columns))]
    listed = ", ".join(
        f"CAST({alias} AS VARCHAR)" if kind == _ZONED else alias
        for alias, kind in zip(aliases, types, strict=True)
    )
    return f"SELECT {listed} FROM (\n{query.rstrip().rstrip(';')}\n) AS asked({', '.join(aliases)})"


def campaign_readings(db: Database, campaign: str) -> QueryResult:
    """List the readings of a campaign, run by run in the order of measurement, without the columns that name it.

    Columns that hold nothing in this campaign are left out.
    """
    names = [name for (name,) in db.rows("SELECT column_name FROM (DESCRIBE v_probings)")]
    wanted = [name for name in names if name not in ("campaign", "machine")]
    counts = db.rows(
        f"SELECT {', '.join(f'count({name})' for name in wanted)} FROM v_probings WHERE campaign = ?",
        [campaign],
    )[0]
    present = tuple(name for name, count in zip(wanted, counts, strict=True) if count)
    rows = db.rows(
        f"SELECT {', '.join(present)} FROM v_probings WHERE campaign = ? ORDER BY run, sequence", [campaign]
    )
    types = dict(db.rows("SELECT column_name, column_type FROM (DESCRIBE v_probings)"))
    return QueryResult(present, tuple(types[name] for name in present), tuple(rows), truncated=False)


def list_machines(db: Database) -> QueryResult:
    """List the machines as the view ``v_machines`` has them."""
    return run_query(db, "SELECT * FROM v_machines ORDER BY machine")


def column_comments(db: Database, table: str) -> dict[str, str]:
    """Return what the comments say of the columns of a table or view, with the unit in brackets."""
    # No value is bound here: the first one makes DuckDB load pandas, which the first page of a server would wait for.
    rows = db.rows("SELECT table_name, column_name, comment FROM duckdb_columns() WHERE comment NOT NULL")
    return {column: comment for of_table, column, comment in rows if of_table == table}
