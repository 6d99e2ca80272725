"""Plants and their names: a plant is known by the first entry of its audit, its names by who published them first.

Two plants may both have a machine MILL-1. The first that publishes keeps the name; the other's is shown as
``MILL-1@PLANT`` from then on, so that a name once seen never becomes another machine's. The models of the methods
themselves are the same everywhere and are shared.

Registering is a transaction of its own that changes the one row of ``registering``: of two at once one finds a
conflict and begins anew, since a lake has no keys that would refuse the second.
"""

from __future__ import annotations

import duckdb

from monitor.exceptions import InputError, StoreError
from monitor.store.connection import utc_now
from monitor.store.lake.attaching import LAKE
from monitor.store.lake.schema import MOST_PLANTS

# Names of a plant's rows that are to be published, by kind; `portion` holds which rows these are.
_INCOMING = """
CREATE OR REPLACE TEMP TABLE incoming_name AS
SELECT 'campaign' AS kind, campaign AS name FROM origin.imported_campaign
WHERE campaign_id IN (SELECT number FROM portion WHERE subject = 'campaign')
UNION
SELECT 'machine', machine FROM origin.imported_campaign
WHERE campaign_id IN (SELECT number FROM portion WHERE subject = 'campaign')
UNION
SELECT 'certificate', number FROM origin.certificate
WHERE entry IN (SELECT number FROM portion WHERE subject = 'certificate')
UNION
SELECT 'model', m.model FROM origin.model AS m
JOIN portion AS p ON p.subject = 'model' AND p.key = m.model || ' version ' || m.version
WHERE m.model NOT IN (SELECT model FROM origin.model WHERE version = 1 AND parent IS NULL)
"""
_CLAIM = f"""
INSERT INTO {LAKE}.plant_name
SELECT $plant_no, kind, name, CASE WHEN taken THEN name || '@' || $plant ELSE name END
FROM (
    SELECT i.kind, i.name, EXISTS (
        SELECT 1 FROM {LAKE}.plant_name AS o WHERE o.kind = i.kind AND o.shown = i.name AND o.plant_no <> $plant_no
    ) AS taken
    FROM incoming_name AS i ANTI JOIN (SELECT * FROM {LAKE}.plant_name WHERE plant_no = $plant_no) USING (kind, name)
)
ORDER BY ALL
"""
# The methods' own models, once for all plants.
_SHARED_MODELS = f"""
INSERT INTO {LAKE}.model
SELECT m.* FROM origin.model AS m
WHERE m.model IN (SELECT model FROM origin.model WHERE version = 1 AND parent IS NULL)
  AND NOT EXISTS (SELECT 1 FROM {LAKE}.model AS l WHERE l.model = m.model AND l.version = m.version)
ORDER BY m.rowid
"""


def register(connection: duckdb.DuckDBPyConnection) -> None:
    """Change the one row that all who register change: the transaction of one of two at once fails."""
    connection.execute(f"UPDATE {LAKE}.registering SET taken = taken + 1")


def registered_plant(
    connection: duckdb.DuckDBPyConnection, first_entry_sha256: str
) -> tuple[int, str] | None:
    """Return number and name of the plant with this first entry; None where it never published."""
    row = connection.execute(
        f"SELECT plant_no, plant FROM {LAKE}.plant WHERE first_entry_sha256 = ?", [first_entry_sha256]
    ).fetchone()
    return None if row is None else (int(row[0]), str(row[1]))


def register_plant(connection: duckdb.DuckDBPyConnection, name: str, first_entry_sha256: str) -> int:
    """Register a plant in the transaction of the caller; its number.

    Raises InputError for a name that another plant has, StoreError where a lake has all the plants that it can.
    """
    register(connection)
    plants = dict(
        connection.execute(f"SELECT plant, plant_no FROM {LAKE}.plant ORDER BY plant_no").fetchall()
    )
    if name in plants:
        raise InputError(
            f"the lake has a plant '{name}' already, which is another database; name this one with --plant NAME"
        )
    number = max(plants.values(), default=0) + 1
    if number > MOST_PLANTS:
        raise StoreError(f"a lake holds at most {MOST_PLANTS} plants")
    connection.execute(
        f"INSERT INTO {LAKE}.plant VALUES (?, ?, ?, ?)", [number, name, first_entry_sha256, utc_now()]
    )
    # Changed with every publication of this plant, so that two processes that publish it at once cannot both succeed;
    # a table of its own, since a lake sees conflicts by table: other plants are not in the way.
    connection.execute(f"CREATE TABLE {LAKE}.{turn_of(number)} (publications BIGINT NOT NULL)")
    connection.execute(f"INSERT INTO {LAKE}.{turn_of(number)} VALUES (0)")
    return number


def turn_of(plant_no: int) -> str:
    """Return the name of the table that a plant changes whenever it publishes."""
    return f"turn_{plant_no:04d}"


def unregistered_names(connection: duckdb.DuckDBPyConnection, plant_no: int) -> bool:
    """Whether the rows to be published bear names, or methods' models, that the lake does not know yet."""
    connection.execute(_INCOMING)
    rows = connection.execute(
        f"SELECT 1 FROM incoming_name ANTI JOIN (SELECT * FROM {LAKE}.plant_name WHERE plant_no = ?) "
        "USING (kind, name) "
        "UNION ALL SELECT 1 FROM origin.model AS m "
        "WHERE m.model IN (SELECT model FROM origin.model WHERE version = 1 AND parent IS NULL) "
        f"AND NOT EXISTS (SELECT 1 FROM {LAKE}.model AS l WHERE l.model = m.model AND l.version = m.version) LIMIT 1",
        [plant_no],
    ).fetchall()
    return bool(rows)


def register_names(connection: duckdb.DuckDBPyConnection, plant_no: int, plant: str) -> None:
    """Register the names of the rows to be published, in the transaction of the caller."""
    register(connection)
    connection.execute(_CLAIM, {"plant_no": plant_no, "plant": plant})
    connection.execute(_SHARED_MODELS)
