"""Compares the schema of a database with that which the migrations make: tables, columns, views, comments, macros.

A view that was replaced shows false numbers to whoever reads it while every stored row is as it was written.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

from monitor.store.connection import Database

#: What is compared, each by a name and by what it is. Indexes have a check of their own (``indexes``).
_QUERIES = {
    "table": "SELECT table_name, comment FROM duckdb_tables() WHERE database_name = current_database()",
    "view": (
        # Names of types get or lose their quotes on the way to the file.
        "SELECT view_name, concat(replace(sql, '\"', ''), ' ', comment) FROM duckdb_views() "
        "WHERE database_name = current_database() AND NOT internal"
    ),
    "column": (
        "SELECT concat(table_name, '.', column_name), concat_ws(' ', column_index, data_type, is_nullable, "
        "column_default, comment) FROM duckdb_columns() WHERE database_name = current_database() AND NOT internal"
    ),
    "constraint": (
        "SELECT concat(table_name, ': ', constraint_text), '' FROM duckdb_constraints() "
        "WHERE database_name = current_database()"
    ),
    "macro": (
        "SELECT function_name, macro_definition FROM duckdb_functions() "
        "WHERE database_name = current_database() AND NOT internal"
    ),
    "sequence": "SELECT sequence_name, '' FROM duckdb_sequences() WHERE database_name = current_database()",
    "schema": (
        "SELECT schema_name, '' FROM duckdb_schemas() WHERE database_name = current_database() AND NOT internal "
        "AND schema_name <> 'main'"
    ),
    "type": (
        "SELECT type_name, '' FROM duckdb_types() WHERE database_name = current_database() AND NOT internal "
        "AND schema_name = 'main'"
    ),
}


def schema_faults(db: Database) -> Iterator[str]:
    """Yield a sentence for everything that the migrations did not make so, or that is missing."""
    for kind, query in _QUERIES.items():
        present, expected = dict(db.rows(query)), _expected()[kind]
        for name in sorted(present.keys() | expected.keys()):
            if name not in expected:
                yield f"the {kind} {name} was not made by this software"
            elif name not in present:
                yield f"the {kind} {name} is missing"
            elif present[name] != expected[name]:
                yield f"the {kind} {name} was altered: it is not as this software makes it"


@cache
def _expected() -> dict[str, dict[str, str]]:
    with Database(":memory:", threads=1) as fresh:
        return {kind: dict(fresh.rows(query)) for kind, query in _QUERIES.items()}
