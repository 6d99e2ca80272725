"""Values that reach DuckDB as constants of ``EXECUTE`` are those that Python binds: same value, same type.

What DuckDB itself makes of the bound value is the reference.
"""

from __future__ import annotations

import sys
from datetime import UTC, date, datetime, timedelta
from typing import Any

import duckdb
import pytest
from hypothesis import given, settings, strategies as st

from monitor.store import Database, bound_values

TEXTS = (
    "",
    "a'b",
    "'); DROP TABLE campaign; --",
    "''",
    "\\",
    "a\\'b",
    "$1 ? :name",
    "ü😀\n\t",
    "e'x",
    "x" * 5000,
)
NUMBERS = (0, -1, 2**31 - 1, 2**31, -(2**31) + 1, -(2**31) - 1, 2**63 - 1, -(2**63) + 1, True, False)
DOUBLES = (0.1, -0.0, 1e300, 5e-324, 1 / 3, float("nan"), float("inf"), -float("inf"))
MOMENTS = (datetime(1, 1, 1), datetime(2026, 3, 2, 4, 5, 6, 7), datetime(9999, 12, 31, 23, 59, 59, 999999))
OTHERS = (None, date(2024, 2, 29), b"\x00\xff'", b"", [1, 2], [1, 2**40], ["a", "b'"], ("x",), [0.5], [True])


@pytest.fixture(scope="module")
def connection() -> duckdb.DuckDBPyConnection:
    return duckdb.connect()


def asked(connection: duckdb.DuckDBPyConnection, sql: str, *constants: str) -> list[Any]:
    connection.execute(f"PREPARE asked AS {sql}")
    return connection.execute(f"EXECUTE asked({', '.join(constants)})").fetchall()


@pytest.mark.parametrize("value", [*TEXTS, *NUMBERS, *DOUBLES, *MOMENTS, *OTHERS], ids=repr)
def test_a_constant_is_the_bound_value(connection: duckdb.DuckDBPyConnection, value: Any) -> None:
    text = bound_values.constant(value)
    assert text is not None
    bound = connection.execute("SELECT $1, typeof($1)", [value]).fetchall()
    assert repr(asked(connection, "SELECT $1, typeof($1)", text)) == repr(bound)


@settings(deadline=None, max_examples=50)
@given(text=st.text(st.characters(exclude_categories=["Cs"]), max_size=40))
def test_any_text_comes_back_and_nothing_else_is_run(
    connection: duckdb.DuckDBPyConnection, text: str
) -> None:
    constant = bound_values.constant(text)
    if "\0" in text:
        assert constant is None
        return
    assert constant is not None
    assert asked(connection, "SELECT $1", constant) == [(text,)]
    assert connection.execute("SELECT count(*) FROM duckdb_tables()").fetchall() == [(0,)]


@pytest.mark.parametrize(
    "value",
    [2**63, -(2**31), [], [1, "a"], ["a", None], [[1]], "a\0b", datetime(2026, 1, 1, tzinfo=UTC), timedelta(1)],
    ids=repr,
)  # fmt: skip
def test_what_has_no_constant_of_its_type_is_bound(value: Any) -> None:
    assert bound_values.constant(value) is None


@pytest.mark.parametrize("parameters", [[1, "b'"], {"end": 1, "name": "b'"}])
def test_values_by_position_and_by_name(monkeypatch: pytest.MonkeyPatch, parameters: Any) -> None:
    monkeypatch.delitem(sys.modules, "pandas", raising=False)
    names = ("$end", "$name") if isinstance(parameters, dict) else ("?", "?")
    with duckdb.connect() as connection:
        connection.execute("CREATE TABLE readings (n INTEGER, name VARCHAR)")
        bound_values.execute(connection, f"INSERT INTO readings VALUES ({names[0]}, {names[1]})", parameters)
        query = f"SELECT name FROM readings WHERE n = {names[0]} AND name = {names[1]}"
        assert bound_values.execute(connection, query, parameters).fetchall() == [("b'",)]
        assert [
            row[0] for row in connection.execute("SELECT name FROM duckdb_prepared_statements()").fetchall()
        ] == ["asked"]


def test_a_variable_without_a_constant_is_refused() -> None:
    with (
        Database(":memory:") as db,
        pytest.raises(TypeError, match="the variable first_d has no constant of SQL"),
    ):
        db.set_variables({"first_d": []})
