"""Which rows of a plant go with which entries of its audit, and the statements that add them to a lake.

The numbers get the plant's above them, names that another plant had first get ``@PLANT``; all else is as it was stored.
"""

from __future__ import annotations

from collections.abc import Iterator

import duckdb

from monitor.store.entries import rows_recorded
from monitor.store.lake.attaching import LAKE
from monitor.store.lake.extensions import literal
from monitor.store.lake.schema import LARGEST_OWN, OWN_BITS
from monitor.store.opening import busy
from monitor.store.turns import Holder, Patience, holder_in, ticket_to_read, writer_at_work

_NUMBERED = frozenset(
    ("analysis_id", "campaign_id", "choice_id", "event_id", "identification_id", "refusal_id", "registration",
     "selection_id")
)  # fmt: skip
#: Columns that hold names, and the kind of name.
_NAMED = {
    "campaign": "campaign",
    "machine": "machine",
    "model": "model",
    "number": "certificate",
    "parent": "model",
    "replaced_by": "certificate",
}

_BASE_MODELS = "(SELECT model FROM origin.model WHERE version = 1 AND parent IS NULL)"


def attach_origin(connection: duckdb.DuckDBPyConnection, path: str, patience: Patience) -> None:
    """Attach the file of a plant as ``origin``, to be read. Raises BusyError, duckdb.Error."""
    holder: Holder | None = None

    def last_holder() -> Holder | None:
        return holder

    with ticket_to_read(path) as ticket:
        for _ in patience.tries(last_holder):
            holder = writer_at_work(path)
            if holder is None:
                try:
                    connection.execute(f"ATTACH {literal(path)} AS origin (READ_ONLY)")
                    return
                except duckdb.Error as fault:
                    holder = holder_in(str(fault))
                    if holder is None:
                        raise
            ticket.take()
    raise busy(path, holder, patience)


def statements(connection: duckdb.DuckDBPyConnection, plant_no: int, renamed: set[str]) -> Iterator[str]:
    """Yield the INSERTs that add the rows of the portion; ``renamed`` are the kinds of names of which some differ."""
    columns: dict[str, list[str]] = {}
    for table, column in connection.execute(
        "SELECT table_name, column_name FROM duckdb_columns() WHERE database_name = 'origin' AND NOT internal "
        "AND table_name IN (SELECT table_name FROM duckdb_tables() WHERE database_name = 'origin') "
        "ORDER BY table_name, column_index"
    ).fetchall():
        columns.setdefault(table, []).append(column)
    offset = plant_no << OWN_BITS
    recorded = rows_recorded(connection)
    for table, where in recorded.items():
        # The methods' own models are shared.
        shared = f" AND t.model NOT IN {_BASE_MODELS}" if table == "model" else ""
        yield _insert(table, columns[table], offset, renamed, where + shared)
    if "imported_campaign" not in recorded:
        return
    published = f"BETWEEN {offset} AND {offset + LARGEST_OWN}"
    where = (
        f"t.registration + {offset} NOT IN (SELECT registration FROM {LAKE}.registered_machine WHERE registration "
        f"{published}) AND t.machine IN (SELECT name FROM {LAKE}.plant_name WHERE kind = 'machine' "
        f"AND plant_no = {plant_no})"
    )
    yield _insert("registered_machine", columns["registered_machine"], offset, renamed, where)
    where = (
        f"t.campaign_id + {offset} NOT IN (SELECT campaign_id FROM {LAKE}.run_fingerprint WHERE campaign_id "
        f"{published}) AND t.campaign_id + {offset} IN (SELECT campaign_id FROM {LAKE}.imported_campaign "
        f"WHERE campaign_id {published})"
    )
    yield _insert("run_fingerprint", columns["run_fingerprint"], offset, renamed, where)


def _insert(table: str, columns: list[str], offset: int, renamed: set[str], where: str) -> str:
    named = ", ".join(f'"{column}"' for column in columns)
    values = ", ".join(_value(table, column, offset, renamed) for column in columns)
    return (
        f'INSERT INTO {LAKE}."{table}" ({named}) SELECT {values} FROM origin."{table}" AS t WHERE {where} '
        "ORDER BY t.rowid"
    )


def _value(table: str, column: str, offset: int, renamed: set[str]) -> str:
    if column in _NUMBERED or (column == "entry" and table in ("audit", "certificate")):
        return f"CAST(t.{column} + {offset} AS INTEGER)"
    if _NAMED.get(column) in renamed:
        return _shown(_NAMED[column], f"t.{column}")
    if "machine" in renamed and column == "machine_description":
        shown = _shown("machine", "t.machine")
        return (
            f"CASE WHEN {shown} = t.machine THEN t.machine_description "
            f"ELSE json_merge_patch(t.machine_description, json_object('id', {shown})) END"
        )
    if "machine" in renamed and column == "machine_hash":
        machine = "(SELECT machine FROM origin.imported_campaign AS c WHERE c.campaign_id = t.campaign_id)"
        return f"CAST(md5_number_lower({_shown('machine', machine)}) % 16777216 AS INTEGER)"
    return f't."{column}"'


def _shown(kind: str, name: str) -> str:
    """Return the SQL of the name that the lake shows for a name of the plant."""
    return f"coalesce((SELECT n.shown FROM renamed AS n WHERE n.kind = {literal(kind)} AND n.name = {name}), {name})"
