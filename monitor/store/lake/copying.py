"""Which rows of a plant go with which entries of its audit, and the statements that add them to a lake.

The numbers get the plant's above them, names that another plant had first get ``@PLANT``; all else is as it was stored.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import duckdb

from monitor.store.lake.attaching import LAKE, literal
from monitor.store.lake.schema import LARGEST_OWN, OWN_BITS
from monitor.store.opening import busy
from monitor.store.turns import Holder, Patience, holder_in, writer_at_work


@dataclass(frozen=True)
class _Source:
    """Which rows of a table an entry of the audit records: those whose ``column`` is the number of its ``subject``."""

    subject: str
    column: str


#: Tables of which an import, and an identification, adds the rows.
_WITH_CAMPAIGN = "imported_campaign source_file run campaign_runs probing curve curve_row"
_WITH_IDENTIFICATION = (
    "identification identified_run identified_values parameter_value parameter_frame residual"
)
#: Every table of a plant and what its rows belong to. Those that belong to nothing are published otherwise, below.
SOURCES: dict[str, _Source] = {
    **dict.fromkeys(_WITH_CAMPAIGN.split(), _Source("campaign", "campaign_id")),
    **dict.fromkeys(_WITH_IDENTIFICATION.split(), _Source("identification", "identification_id")),
    "import_note": _Source("import notes", "campaign_id"),
    "withdrawn_campaign": _Source("withdrawn campaign", "campaign_id"),
    "analysis": _Source("analysis", "analysis_id"),
    "event": _Source("event", "event_id"),
    "selection": _Source("selection", "selection_id"),
    "machine_model": _Source("machine model", "choice_id"),
    "refused_import": _Source("refused import", "refusal_id"),
    "refusal_cleared": _Source("cleared refusal", "refusal_id"),
    "certificate": _Source("certificate", "entry"),
    "audit": _Source("entry", "entry"),
}
#: Tables with rows that no entry names (``run_fingerprint`` may come later than its campaign), or of the schema itself.
OTHERWISE = ("model", "registered_machine", "run_fingerprint", "schema_migration")

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

#: The rows that the entries from first to last of a plant's audit record.
PORTION_OF_ENTRIES = """
CREATE OR REPLACE TEMP TABLE portion AS
WITH entries AS (
    SELECT entry, subject, key, row_number() OVER (PARTITION BY subject, key ORDER BY entry) AS nth FROM origin.audit
), campaigns AS (
    SELECT campaign_id, campaign, row_number() OVER (PARTITION BY campaign ORDER BY campaign_id) AS nth
    FROM origin.imported_campaign
), next AS (SELECT * FROM entries WHERE entry BETWEEN $first AND $last)
SELECT 'campaign' AS subject, key, campaign_id AS number
FROM next JOIN campaigns ON campaign = key AND campaigns.nth = next.nth WHERE subject = 'campaign'
UNION ALL SELECT subject, key, NULL FROM next WHERE subject = 'model'
UNION ALL SELECT subject, key, CAST(regexp_extract(key, ' entry ([0-9]+)$', 1) AS INTEGER)
FROM next WHERE subject = 'certificate'
UNION ALL SELECT subject, key, CAST(key AS INTEGER) FROM next WHERE subject NOT IN ('campaign', 'model', 'certificate')
UNION ALL SELECT 'entry', '', entry FROM next
"""


_BASE_MODELS = "(SELECT model FROM origin.model WHERE version = 1 AND parent IS NULL)"


def attach_origin(connection: duckdb.DuckDBPyConnection, path: str, patience: Patience) -> None:
    """Attach the file of a plant as ``origin``, to be read. Raises BusyError, duckdb.Error."""
    holder: Holder | None = None

    def last_holder() -> Holder | None:
        return holder

    for _ in patience.tries(last_holder):
        holder = writer_at_work(path)
        if holder is not None:
            continue
        try:
            connection.execute(f"ATTACH {literal(path)} AS origin (READ_ONLY)")
            return
        except duckdb.Error as fault:
            holder = holder_in(str(fault))
            if holder is None:
                raise
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
    spans = {
        subject: (low, high)
        for subject, low, high in connection.execute(
            "SELECT subject, min(number), max(number) FROM portion GROUP BY subject"
        ).fetchall()
    }
    for table, source in SOURCES.items():
        if source.subject not in spans:
            continue
        low, high = spans[source.subject]
        # The span lets blocks of other numbers be left out unread.
        where = (
            f"t.{source.column} BETWEEN {low} AND {high} AND t.{source.column} IN "
            f"(SELECT number FROM portion WHERE subject = {literal(source.subject)})"
        )
        yield _insert(table, columns[table], offset, renamed, where)
    if "model" in spans:
        where = (
            "t.model || ' version ' || t.version IN (SELECT key FROM portion WHERE subject = 'model') "
            f"AND t.model NOT IN {_BASE_MODELS}"
        )
        yield _insert("model", columns["model"], offset, renamed, where)
    if "campaign" not in spans:
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
