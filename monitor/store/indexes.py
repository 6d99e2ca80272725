"""Secondary indexes, which this software does not have, and the rows that DuckDB may have lost from one.

DuckDB 1.5 replays the write-ahead log after a crash without adding the replayed rows to an index that the session does
not use; its checkpoint then writes the index without them, and an equality on the indexed column misses them for good.
Primary keys are not affected. Migration 0010 drops the indexes that earlier versions had; somebody else may add one.
"""

from __future__ import annotations

from collections.abc import Iterator

import duckdb

from monitor.store.connection import Database

_INDEXES = """
SELECT index_name, table_name, regexp_replace(expressions, '^\\[(.*)\\]$', '\\1')
FROM duckdb_indexes() WHERE database_name = current_database() ORDER BY ALL
"""


def index_faults(db: Database) -> Iterator[str]:
    """Yield a sentence for each secondary index, with the number of rows that it does not find."""
    for index, table, expression in db.rows(_INDEXES):
        missed = _missed_rows(db, table, expression)
        loss = f" and does not find {missed} of them" if missed else ""
        name = index if index.isidentifier() else '"' + index.replace('"', '""') + '"'
        yield (
            f"the index {index} over rows of {table} was not made by this software{loss}: DuckDB 1.5 can lose rows "
            f"from an index after a crash, and queries then miss them; `DROP INDEX {name}` repairs it without loss"
        )


def _missed_rows(db: Database, table: str, expression: str) -> int:
    """Return how many rows a scan finds and the index does not; 0 for an index over several columns or a formula."""
    columns = {
        name for (name,) in db.rows("SELECT column_name FROM duckdb_columns() WHERE table_name = ?", [table])
    }
    column = expression.strip("'\"")
    if column not in columns:
        return 0
    quoted_table, quoted_column = (name.replace('"', '""') for name in (table, column))
    missed = 0
    try:
        groups = db.rows(f'SELECT "{quoted_column}", count(*) FROM "{quoted_table}" GROUP BY ALL')
        for value, count in groups:
            query = f'SELECT count(*) FROM "{quoted_table}" WHERE "{quoted_column}" = ?'
            missed += 0 if value is None else count - db.rows(query, [value])[0][0]
    except duckdb.Error:
        return 0
    return missed
