"""Gathers the rows of ``parameter_value`` into a row an identification, some thousands at a time.

One statement for all needs more memory than a machine has: an ordered list is held for every value at once, and 8
million values (500 machines over five years) did not fit into 4 GB. Migration 0007, which made the table, holds such a
statement; this one takes its place when it is applied (see ``migrations``).
"""

from __future__ import annotations

import duckdb

#: Identifications taken together: 20 000 of 15 parameters and 4 runs stay within 0.5 GB.
PORTION = 20_000
#: How the statement of migration 0007 begins that is not run as it stands.
REPLACED = "INSERT INTO identified_values"

# Values run by run. Sorted within the list: where several threads gather them, rows reach a list in any order.
_RUN_BY_RUN = """
    SELECT identification_id, n, list_sort(list_distinct(list_transform(cells, lambda cell: cell.run))) AS runs,
           list_transform(cells, lambda cell: cell.value) AS value, list_transform(cells, lambda cell: cell.u) AS u
    FROM (
        SELECT identification_id, any_value(len(parameters)) AS n, list_sort(list(
            {'run': run, 'place': list_position(parameters, parameter), 'value': value, 'u': u}
        )) AS cells
        FROM parameter_value JOIN identification USING (identification_id)
        WHERE identification_id >= ? AND identification_id < ?
        GROUP BY identification_id
    )
"""
#: The table as migration 0007 makes it.
RUN_BY_RUN = f"""
INSERT INTO identified_values
SELECT identification_id, runs, value, u FROM ({_RUN_BY_RUN}) ORDER BY identification_id
"""
#: The table as it is since migration 0009.
BY_PARAMETER = f"""
INSERT INTO identified_values
SELECT identification_id, runs, list_transform(range(1, n + 1), lambda p: value[p:len(value):n]),
       list_transform(range(1, n + 1), lambda p: u[p:len(u):n])
FROM ({_RUN_BY_RUN})
ORDER BY identification_id
"""


def gather(connection: duckdb.DuckDBPyConnection, sql: str, portion: int = PORTION) -> None:
    """Write the rows of ``identified_values`` that are missing after the last that is there, as ``sql`` has them."""
    (first, end) = (_after_last(connection, table) for table in ("identified_values", "identification"))
    for start in range(first, end, portion):
        connection.execute(sql, [start, min(start + portion, end)])


def _after_last(connection: duckdb.DuckDBPyConnection, table: str) -> int:
    row = connection.execute(f"SELECT coalesce(max(identification_id), 0) + 1 FROM {table}").fetchone()
    assert row is not None
    return int(row[0])
