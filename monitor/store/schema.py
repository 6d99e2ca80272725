"""Compares the schema of a database with that which the migrations make: tables, columns, views, comments, macros.

A view that was replaced shows false numbers to whoever reads it while every stored row is as it was written.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from functools import cache

import duckdb

from monitor.store.connection import Database

#: SHA-256 of what ``_QUERIES`` answer of a database that the migrations of today have just made, by the version of
#: DuckDB, which writes the SQL of views in its own way. A schema that has it is compared with nothing else: to make
#: such a database takes 0.1 s, a quarter of a verification of a small one. Of any other schema every part is compared.
#: ``tests/store/test_schema.py`` makes it anew and says what to write here after a migration.
FINGERPRINTS = {"1.5.5": "1f3fd9e059541217d78922dbaaaacb0941092fab72f401253f8803e601cfdf6b"}

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
    schema = stored_schema(db)
    if FINGERPRINTS.get(duckdb.__version__) == fingerprint(schema):
        return
    for kind, expected in _expected().items():
        present = schema[kind]
        for name in sorted(present.keys() | expected.keys()):
            if name not in expected:
                yield f"the {kind} {name} was not made by this software"
            elif name not in present:
                yield f"the {kind} {name} is missing"
            elif present[name] != expected[name]:
                yield f"the {kind} {name} was altered: it is not as this software makes it"


def stored_schema(db: Database) -> dict[str, dict[str, str | None]]:
    """Return what each name of each kind is in this database."""
    return {kind: dict(db.rows(query)) for kind, query in _QUERIES.items()}


def fingerprint(schema: Mapping[str, Mapping[str, str | None]]) -> str:
    """Return the SHA-256 of a schema, whatever the order in which its names were read."""
    return hashlib.sha256(json.dumps(schema, sort_keys=True).encode()).hexdigest()


@cache
def _expected() -> dict[str, dict[str, str | None]]:
    with Database(":memory:", threads=1) as fresh:
        return stored_schema(fresh)
