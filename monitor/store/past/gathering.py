"""Gathers rows of a table into lists, a row an identification or a campaign, some thousands of these at a time.

One statement for all needs more memory than a machine has: an ordered list is held for every value at once, and 8
million values (500 machines over five years) did not fit into 4 GB. Migrations 0007 and 0011, which made the tables,
hold such statements; those of ``REPLACEMENTS`` take their places when they are applied (see ``migrations``).
"""

from __future__ import annotations

from dataclasses import dataclass

import duckdb

#: Identifications or campaigns taken together: 20 000 of 15 parameters and 4 runs stay within 0.5 GB.
PORTION = 20_000


@dataclass(frozen=True)
class Gathering:
    """A table that is filled in portions of ``key`` by ``sql``, of the keys ``$first`` to ``$end`` (exclusive).

    ``source`` is the table that holds every key.
    """

    table: str
    source: str
    key: str
    sql: str


# Values run by run. Sorted within the list: where several threads gather them, rows reach a list in any order.
_RUN_BY_RUN = """
    SELECT identification_id, n, list_sort(list_distinct(list_transform(cells, lambda cell: cell.run))) AS runs,
           list_transform(cells, lambda cell: cell.value) AS value, list_transform(cells, lambda cell: cell.u) AS u
    FROM (
        SELECT identification_id, any_value(len(parameters)) AS n, list_sort(list(
            {'run': run, 'place': list_position(parameters, parameter), 'value': value, 'u': u}
        )) AS cells
        FROM parameter_value JOIN identification USING (identification_id)
        WHERE identification_id >= $first AND identification_id < $end
        GROUP BY identification_id
    )
"""
#: The values of identifications as migration 0007 makes their table.
RUN_BY_RUN = Gathering(
    "identified_values",
    "identification",
    "identification_id",
    f"""
INSERT INTO identified_values
SELECT identification_id, runs, value, u FROM ({_RUN_BY_RUN}) ORDER BY identification_id
""",
)
#: The values of identifications as their table is since migration 0009.
BY_PARAMETER = Gathering(
    "identified_values",
    "identification",
    "identification_id",
    f"""
INSERT INTO identified_values
SELECT identification_id, runs, list_transform(range(1, n + 1), lambda p: value[p:len(value):n]),
       list_transform(range(1, n + 1), lambda p: u[p:len(u):n])
FROM ({_RUN_BY_RUN})
ORDER BY identification_id
""",
)
_RUN_COLUMNS = ("run", "started_at", "utc_offset_s", "day", "warm_up", "conditions")
#: The rows of ``campaign_runs`` as the tables of runs and campaigns have them, ordered by ``run``; a curve has none.
#: A list of records, sorted once, takes a fifth of the time of six ordered lists.
RUN_LISTS = f"""
SELECT campaign_id, CAST(md5_number_lower(machine) % 16777216 AS INTEGER) AS machine_hash,
       {", ".join(f"coalesce(list_transform(runs, lambda r: r.{name}), []) AS {name}" for name in _RUN_COLUMNS)}
FROM imported_campaign LEFT JOIN (
    SELECT campaign_id, list_sort(list({{{", ".join(f"'{name}': {name}" for name in _RUN_COLUMNS)}}})) AS runs
    FROM run WHERE campaign_id >= $first AND campaign_id < $end GROUP BY campaign_id
) USING (campaign_id)
WHERE campaign_id >= $first AND campaign_id < $end
"""
#: The runs of campaigns as migration 0011 makes their table.
CAMPAIGN_RUNS = Gathering(
    "campaign_runs",
    "imported_campaign",
    "campaign_id",
    f"INSERT INTO campaign_runs SELECT * FROM ({RUN_LISTS}) ORDER BY campaign_id",
)
#: By how the statement of a migration begins that is not run as it stands.
REPLACEMENTS = {f"INSERT INTO {gathering.table}": gathering for gathering in (RUN_BY_RUN, CAMPAIGN_RUNS)}


def gather(connection: duckdb.DuckDBPyConnection, gathering: Gathering, portion: int = PORTION) -> None:
    """Write the rows of the table of a gathering that are missing after the last that is there."""
    (first, end) = (
        _after_last(connection, table, gathering.key) for table in (gathering.table, gathering.source)
    )
    for start in range(first, end, portion):
        connection.execute(gathering.sql, {"first": start, "end": min(start + portion, end)})


def _after_last(connection: duckdb.DuckDBPyConnection, table: str, key: str) -> int:
    row = connection.execute(f"SELECT coalesce(max({key}), 0) + 1 FROM {table}").fetchone()
    assert row is not None
    return int(row[0])
