"""The fingerprint of the schema is that of the migrations, and no schema that differs from theirs has it."""

from __future__ import annotations

from collections.abc import Iterator

import duckdb
import pytest

from monitor.store import Database
from monitor.store.schema import FINGERPRINTS, fingerprint, schema_faults, stored_schema

#: A change of every kind that is compared, with the kind.
CHANGES = {
    "table": "COMMENT ON TABLE run IS 'nothing'",
    "view": "CREATE OR REPLACE VIEW v_events AS SELECT 1 AS number",
    "column": "ALTER TABLE event ADD COLUMN further INTEGER",
    "constraint": "CREATE TABLE further (number INTEGER CHECK (number > 0))",
    "macro": "CREATE MACRO doubled(x) AS 2 * x",
    "sequence": "CREATE SEQUENCE further",
    "schema": "CREATE SCHEMA further",
    "type": "CREATE TYPE colour AS ENUM ('red')",
}


@pytest.fixture
def fresh(made_anew: None) -> Iterator[Database]:
    """A database that the migrations have just made."""
    with Database(":memory:") as db:
        yield db


def test_the_fingerprint_is_that_of_the_migrations(fresh: Database) -> None:
    made = fingerprint(stored_schema(fresh))
    version = duckdb.__version__
    assert FINGERPRINTS.get(version) == made, (
        f"FINGERPRINTS of monitor/store/schema.py: {version!r}: {made!r}"
    )


@pytest.mark.parametrize("kind", CHANGES)
def test_a_change_of_every_kind_is_seen(fresh: Database, kind: str) -> None:
    fresh.execute(CHANGES[kind])
    assert any(f"the {kind} " in fault for fault in schema_faults(fresh))
    assert fingerprint(stored_schema(fresh)) not in FINGERPRINTS.values()


def test_without_a_fingerprint_every_part_is_compared(
    fresh: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As with another version of DuckDB."""
    monkeypatch.setattr("monitor.store.schema.FINGERPRINTS", {})
    assert list(schema_faults(fresh)) == []
