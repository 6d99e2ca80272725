"""The reference of the database: its views from their comments in a new database."""

# ruff: noqa: E501 -- prose of pages
from __future__ import annotations

import tempfile
from pathlib import Path

import duckdb
from markdown import code, table

from monitor import store

HEAD = """# Views of the database

For people who know SQL. The views are kept from version to version; columns may be added. The tables behind them are not meant to be read. Every name, type and
comment on this page comes from the database itself; `SELECT column_name, comment FROM duckdb_columns() WHERE table_name = 'v_parameters'` prints them
there. Times are UTC. Ways to ask: [SQL and Python people](../howto-sql-and-python.md).

"""


def page() -> str:
    """Return the page."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "new.duckdb"
        store.SharedDatabase(path, read_only=False, threads=1, actor="manual").close()
        with duckdb.connect(str(path), read_only=True) as connection:
            views = connection.execute(
                "SELECT view_name, comment FROM duckdb_views() WHERE NOT internal AND view_name LIKE 'v\\_%' ESCAPE '\\' "
                "ORDER BY view_name"
            ).fetchall()
            columns = connection.execute(
                "SELECT table_name, column_name, data_type, comment FROM duckdb_columns() ORDER BY table_name, column_index"
            ).fetchall()
    parts = [HEAD, table(("view", "holds"), ((f"[`{name}`](#{name})", words or "") for name, words in views))]
    for name, words in views:
        rows = [(code(column), kind.lower(), note or "") for of, column, kind, note in columns if of == name]
        parts.append(f"## {name}\n\n{words or ''}\n\n{table(('column', 'type', 'meaning (unit)'), rows)}")
    return "\n".join(parts)
