"""Every table, view and column says what it is, and in which unit."""

from __future__ import annotations

import re

from monitor.store import Database

#: What counts as naming a unit; a quantity without one says "no unit".
UNIT = re.compile(
    r"no unit|\bUTC\b|local time|\bmm\b|µm|µrad|\brad\b|\(s\)|degree|degC|display unit|units are in the keys"
    r"|unit that its name ends in"
)


def test_every_table_and_view_has_a_comment(db: Database) -> None:
    found = db.rows(
        "SELECT table_name, comment FROM duckdb_tables() UNION ALL "
        "SELECT view_name, comment FROM duckdb_views() WHERE NOT internal"
    )
    assert len(found) > 20
    assert [name for name, comment in found if not comment] == []


def test_every_column_names_its_unit(db: Database) -> None:
    found = db.rows("SELECT table_name, column_name, comment FROM duckdb_columns() WHERE NOT internal")
    assert len(found) > 200
    assert [(table, column) for table, column, comment in found if not UNIT.search(comment or "")] == []


def test_a_name_that_ends_in_a_unit_agrees_with_its_comment(db: Database) -> None:
    words = {"_mm": "mm", "_um": "µm", "_deg": "degree", "_degc": "Celsius", "_at": "UTC", "_s": "(s)"}
    found = db.rows("SELECT table_name, column_name, comment FROM duckdb_columns() WHERE NOT internal")
    wrong = [
        (table, column)
        for table, column, comment in found
        for end, word in words.items()
        if column.endswith(end) and word not in comment
    ]
    assert wrong == []
