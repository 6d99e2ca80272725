"""Gathers the rows of ``parameter_value`` into a row an identification, some thousands at a time.

One statement for all needs more memory than a machine has: an ordered list is held for every value at once, and 8
million values (500 machines over five years) did not fit into 4 GB. The migration that makes the table holds such a
statement; it is replaced by this one when it is applied (see ``migrations``).
"""

from __future__ import annotations

import duckdb

#: Identifications taken together: 20 000 of 15 parameters and 4 runs stay within 0.5 GB.
PORTION = 20_000
#: How the statement of migration 0007 begins that is not run as it stands.
REPLACED = "INSERT INTO identified_values"

# Sorted within the list: rows reach a list in any order where several threads gather them.
_GATHER = """
INSERT INTO identified_values
SELECT identification_id, list_sort(list_distinct(list_transform(cells, lambda cell: cell.run))),
       list_transform(cells, lambda cell: cell.value), list_transform(cells, lambda cell: cell.u)
FROM (
    SELECT identification_id, list_sort(list(
        {'run': run, 'place': list_position(parameters, parameter), 'value': value, 'u': u}
    )) AS cells
    FROM parameter_value JOIN identification USING (identification_id)
    WHERE identification_id >= ? AND identification_id < ?
    GROUP BY identification_id
)
ORDER BY identification_id
"""


def gather(connection: duckdb.DuckDBPyConnection, portion: int = PORTION) -> None:
    """Write the rows of ``identified_values`` that are missing after the last that is there."""
    (first, end) = (_after_last(connection, table) for table in ("identified_values", "identification"))
    for start in range(first, end, portion):
        connection.execute(_GATHER, [start, min(start + portion, end)])


def _after_last(connection: duckdb.DuckDBPyConnection, table: str) -> int:
    found = connection.execute(f"SELECT coalesce(max(identification_id), 0) + 1 FROM {table}").fetchone()
    assert found is not None
    return int(found[0])
