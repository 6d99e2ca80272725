"""The tables of a lake: those of a plant's database under the same names, and three that say who published what.

They are made from a database of the present schema: the same columns, comments and views, so that every query of one
file is answered by a lake. A lake has no keys; publication sees to it that nothing comes twice.

Numbers (of campaigns, identifications, ...) are a plant's own with the plant's number above them: campaign 7 of plant 3
is ``3 << 21 | 7``. A plant may so have 2 097 151 of each, a lake 1023 plants.
"""

from __future__ import annotations

import graphlib
import re
from collections.abc import Iterator, Mapping

import duckdb

from monitor.exceptions import StoreError
from monitor.store import migrations
from monitor.store.connection import Database
from monitor.store.lake.attaching import LAKE

#: Bits of a plant's own numbers, and so the largest of them and the most plants (numbers are INTEGER, 31 bits).
OWN_BITS = 21
LARGEST_OWN = 2**OWN_BITS - 1
MOST_PLANTS = 2 ** (31 - OWN_BITS) - 1

# fmt: off
# ruff: noqa: E501
_OWN_TABLES = """
CREATE TABLE {lake}.plant (
    plant_no INTEGER NOT NULL, plant VARCHAR NOT NULL, first_entry_sha256 VARCHAR NOT NULL,
    registered_at TIMESTAMP NOT NULL
);
COMMENT ON TABLE {lake}.plant IS 'The databases that publish; number >> 21 of a campaign or identification is its plant_no.';
COMMENT ON COLUMN {lake}.plant.plant_no IS 'Number of the plant, from 1 in the order of registration (no unit)';
COMMENT ON COLUMN {lake}.plant.plant IS 'Name of the plant (no unit)';
COMMENT ON COLUMN {lake}.plant.first_entry_sha256 IS 'Hash of the first entry of its audit: what the database is known by (no unit)';
COMMENT ON COLUMN {lake}.plant.registered_at IS 'When it published first (UTC)';
CREATE TABLE {lake}.publication (
    plant_no INTEGER NOT NULL, first_entry INTEGER NOT NULL, last_entry INTEGER NOT NULL, last_sha256 VARCHAR NOT NULL,
    rows BIGINT NOT NULL, software_version VARCHAR NOT NULL, published_at TIMESTAMP NOT NULL
);
COMMENT ON TABLE {lake}.publication IS 'What was published when: the entries of a plant''s audit from first to last, with all that they record, in one transaction.';
COMMENT ON COLUMN {lake}.publication.plant_no IS 'The plant (no unit)';
COMMENT ON COLUMN {lake}.publication.first_entry IS 'First entry of its audit, numbered there (no unit)';
COMMENT ON COLUMN {lake}.publication.last_entry IS 'Last entry of its audit, numbered there (no unit)';
COMMENT ON COLUMN {lake}.publication.last_sha256 IS 'Hash of that entry, hexadecimal (no unit)';
COMMENT ON COLUMN {lake}.publication.rows IS 'How many rows of all tables came with them (no unit)';
COMMENT ON COLUMN {lake}.publication.software_version IS 'Version of the software that published (no unit)';
COMMENT ON COLUMN {lake}.publication.published_at IS 'When (UTC)';
CREATE TABLE {lake}.plant_name (
    plant_no INTEGER NOT NULL, kind VARCHAR NOT NULL, name VARCHAR NOT NULL, shown VARCHAR NOT NULL
);
COMMENT ON TABLE {lake}.plant_name IS 'Names of machines, campaigns, models and certificates; a name that another plant published first is shown as NAME@PLANT.';
COMMENT ON COLUMN {lake}.plant_name.plant_no IS 'The plant (no unit)';
COMMENT ON COLUMN {lake}.plant_name.kind IS 'machine, campaign, model or certificate (no unit)';
COMMENT ON COLUMN {lake}.plant_name.name IS 'The name at the plant (no unit)';
COMMENT ON COLUMN {lake}.plant_name.shown IS 'The name here (no unit)';
CREATE TABLE {lake}.registering (taken BIGINT NOT NULL);
COMMENT ON TABLE {lake}.registering IS 'One row: whoever registers a plant or a name changes it, so that of two at once one begins anew.';
COMMENT ON COLUMN {lake}.registering.taken IS 'How often (no unit)';
INSERT INTO {lake}.registering VALUES (0);
"""
# fmt: on


def has_schema(connection: duckdb.DuckDBPyConnection) -> bool:
    """Whether the attached lake has tables of ours."""
    return bool(
        connection.execute(
            "SELECT 1 FROM duckdb_tables() WHERE database_name = ? AND table_name = 'schema_migration'",
            [LAKE],
        ).fetchall()
    )


def check_schema(connection: duckdb.DuckDBPyConnection, address: str) -> None:
    """Refuse a lake that another schema than that of this software made. Raises StoreError."""
    connection.execute(f"USE {LAKE}")
    try:
        waiting = migrations.pending(connection, migrations.available())
    except StoreError as fault:
        raise StoreError(f"{address}: {fault}") from fault
    finally:
        connection.execute("USE memory")
    if waiting:
        raise StoreError(
            f"{address} has the schema of older software (without {waiting[0].name}). A lake is not brought to a newer "
            "one but made again: let every plant publish to a new address with this version"
        )


def make_schema(connection: duckdb.DuckDBPyConnection) -> None:
    """Make the tables and views of an empty lake, in the transaction of the caller."""
    with Database(":memory:", threads=1) as model:
        tables = model.rows("SELECT table_name, comment FROM duckdb_tables() WHERE NOT internal ORDER BY ALL")
        views = model.rows(
            "SELECT view_name, sql, comment FROM duckdb_views() WHERE NOT internal ORDER BY view_name"
        )
        columns = model.rows(
            "SELECT table_name, column_name, data_type, is_nullable, comment FROM duckdb_columns() "
            "WHERE NOT internal ORDER BY table_name, column_index"
        )
        applied = model.rows("SELECT * FROM schema_migration ORDER BY number")
    for table, comment in tables:
        of_table = [column for column in columns if column[0] == table]
        defined = ", ".join(
            f'"{name}" {kind}{"" if nullable else " NOT NULL"}' for _, name, kind, nullable, _ in of_table
        )
        connection.execute(f'CREATE TABLE {LAKE}."{table}" ({defined})')
        connection.execute(f'COMMENT ON TABLE {LAKE}."{table}" IS {_text(comment)}')
        for _, name, _, _, of_column in of_table:
            connection.execute(f'COMMENT ON COLUMN {LAKE}."{table}"."{name}" IS {_text(of_column)}')
    for statement in connection.extract_statements(_OWN_TABLES.format(lake=LAKE)):
        connection.execute(statement)
    for row in applied:
        connection.execute(
            f"INSERT INTO {LAKE}.schema_migration VALUES ({', '.join('?' * len(row))})", list(row)
        )
    # Views name their tables without the lake, so that they hold under whatever name it is attached.
    connection.execute(f"USE {LAKE}")
    comments = {view: comment for view, _, comment in views}
    sql_of = {view: sql for view, sql, _ in views}
    for view in _in_order(sql_of):
        connection.execute(sql_of[view])
        connection.execute(f'COMMENT ON VIEW "{view}" IS {_text(comments[view])}')
    connection.execute("USE memory")


def _in_order(views: Mapping[str, str]) -> Iterator[str]:
    """Yield the names of views, each behind those that it reads."""
    reads = {
        view: {source for source in re.findall(r"\b(?:FROM|JOIN)\s+\(*(\w+)", sql) if source in views}
        - {view}
        for view, sql in views.items()
    }
    return iter(graphlib.TopologicalSorter(reads).static_order())


def _text(comment: str | None) -> str:
    return "'" + (comment or "").replace("'", "''") + "'"
