"""Brings a database to the present schema: numbered SQL files, forward only, each in a transaction of its own.

Each applied file leaves its number, name and checksum in ``schema_migration``, in the same transaction. A
database is refused, in words, when it was made by newer software, when a file that made it was edited or is
missing, or when it is not one of ours.

Two statements are not run as their files have them: see ``gathering``.
"""

from __future__ import annotations

import contextlib
import hashlib
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import duckdb

from monitor import __version__
from monitor.exceptions import StoreError
from monitor.store import bound_values
from monitor.store.past import gathering
from monitor.store.resources import migration_folder

_FILE_NAME = re.compile(r"(\d{4})_[a-z0-9_]+\.sql")

_LEDGER = """
CREATE TABLE schema_migration (
    number INTEGER PRIMARY KEY,
    name VARCHAR NOT NULL,
    sha256 VARCHAR NOT NULL,
    software_version VARCHAR NOT NULL,
    applied_at TIMESTAMP NOT NULL
);
COMMENT ON TABLE schema_migration IS 'The SQL files that made this schema, in order.';
COMMENT ON COLUMN schema_migration.number IS 'Number of the file, from 1 without a gap (no unit)';
COMMENT ON COLUMN schema_migration.name IS 'Name of the file (no unit)';
COMMENT ON COLUMN schema_migration.sha256 IS 'SHA-256 of its normalised text, hexadecimal (no unit)';
COMMENT ON COLUMN schema_migration.software_version IS 'Version of the software that applied it (no unit)';
COMMENT ON COLUMN schema_migration.applied_at IS 'When it was applied (UTC)';
"""


@dataclass(frozen=True)
class Migration:
    """One numbered SQL file."""

    number: int
    name: str
    sql: str

    @property
    def sha256(self) -> str:
        """The hash of the text without what an editor or git may change: line ends and trailing blanks."""
        lines = [line.rstrip() for line in self.sql.splitlines()]
        return hashlib.sha256("\n".join(lines).strip("\n").encode()).hexdigest()


def available() -> tuple[Migration, ...]:
    """The migrations of this software, in order."""
    migrations = []
    for entry in migration_folder().iterdir():
        match = _FILE_NAME.fullmatch(entry.name)
        if match:
            migrations.append(Migration(int(match[1]), entry.name, entry.read_text(encoding="utf-8")))
    return tuple(sorted(migrations, key=lambda migration: migration.number))


def applied(connection: duckdb.DuckDBPyConnection) -> list[tuple[int, str, str, str]]:
    """Number, name, checksum and software version of every applied migration, in order."""
    try:
        return connection.execute(
            "SELECT number, name, sha256, software_version FROM schema_migration ORDER BY number"
        ).fetchall()
    except duckdb.CatalogException:
        # Asked only now: the list of tables takes a third as long as opening the file, and every verb opens one.
        tables = connection.execute(
            "SELECT table_name FROM duckdb_tables() WHERE database_name = current_database() ORDER BY ALL"
        ).fetchall()
        if not tables:
            return []
        if ("schema_migration",) in tables:
            raise
        names = ", ".join(name for (name,) in tables[:5])
        raise StoreError(f"this is a DuckDB file of something else: it has the tables {names}") from None


def pending(connection: duckdb.DuckDBPyConnection, migrations: Sequence[Migration]) -> tuple[Migration, ...]:
    """The migrations still to be applied.

    Raises StoreError where the database does not fit this software: newer, an edited or a missing file.
    """
    numbers = [migration.number for migration in migrations]
    if numbers != list(range(1, len(numbers) + 1)):
        raise StoreError(f"the migrations must be numbered 1, 2, 3, ... without a gap; there are {numbers}")
    by_number = {migration.number: migration for migration in migrations}
    ledger = applied(connection)
    for number, name, sha256, version in ledger:
        if number > len(numbers):
            raise StoreError(
                f"the database is newer than this software: {version} brought it to {name}, and this is "
                f"{__version__}, which knows {len(numbers)} migrations; use {version} or later"
            )
        if by_number[number].name != name:
            raise StoreError(
                f"the migration {name}, which made this database, is missing from this installation "
                f"(in its place is {by_number[number].name}); install the software again"
            )
        if by_number[number].sha256 != sha256:
            raise StoreError(
                f"the migration {name} was edited after it was applied to this database by {version}; "
                "bring the file back as it was released and put the change into a new one"
            )
    return tuple(migrations[len(ledger) :])


def migrate(
    connection: duckdb.DuckDBPyConnection,
    migrations: Sequence[Migration],
    before_commit: Callable[[], None] = lambda: None,
) -> tuple[str, ...]:
    """Apply what is pending, each in its own transaction; the names of what was applied.

    Raises StoreError naming the migration that failed; nothing of that one is left, those before it stay.
    """
    names = []
    for migration in pending(connection, migrations):
        _apply(connection, migration, before_commit)
        names.append(migration.name)
    return tuple(names)


def _apply(
    connection: duckdb.DuckDBPyConnection, migration: Migration, before_commit: Callable[[], None]
) -> None:
    try:
        statements = connection.extract_statements(migration.sql)
    except duckdb.Error as fault:
        raise StoreError(f"the migration {migration.name} failed and left nothing: {fault}") from fault
    if any(statement.type == duckdb.StatementType.TRANSACTION for statement in statements):
        raise StoreError(f"the migration {migration.name} may not begin or end a transaction itself")
    connection.begin()
    try:
        if migration.number == 1:
            connection.execute(_LEDGER)
        for statement in statements:
            replacement = _replacement(statement.query)
            if replacement is None:
                connection.execute(statement)
            else:
                gathering.gather(connection, replacement)
        bound_values.execute(
            connection,
            "INSERT INTO schema_migration VALUES (?, ?, ?, ?, ?)",
            [
                migration.number,
                migration.name,
                migration.sha256,
                __version__,
                datetime.now(UTC).replace(tzinfo=None),
            ],
        )
        before_commit()
        connection.commit()
    except duckdb.Error as fault:
        # A commit that found the disk full has rolled back already.
        with contextlib.suppress(duckdb.Error):
            connection.rollback()
        raise StoreError(f"the migration {migration.name} failed and left nothing: {fault}") from fault


def _replacement(statement: str) -> gathering.Gathering | None:
    """Return what is gathered in portions in place of a statement; None for one that is run as it stands."""
    text = statement.lstrip()
    return next(
        (gathered for start, gathered in gathering.REPLACEMENTS.items() if text.startswith(start)), None
    )
