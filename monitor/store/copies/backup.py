"""Full backups: a second file, compared with the first table by table, and a manifest beside it.

A backup can be made while the database is in use by this process; it shows one moment, copy and manifest alike.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import duckdb

from monitor.exceptions import StoreError
from monitor.store.connection import Database
from monitor.store.copies.manifest import (
    Backup,
    Checksums,
    Span,
    manifest_of,
    refuse_existing,
    remove_partial,
    write_manifest,
)
from monitor.store.database_name import check_database_name
from monitor.store.opening import make_log, refuse_log_apart, sync_folder


def take_backup(db: Database, target: str | Path) -> Backup:
    """Copy the database into the new file ``target`` and write ``target.manifest.json``.

    Raises StoreError where the target exists or cannot be written, or the copy differs from the original.
    """
    target = Path(target)
    with finished_copy(target) as partial:
        with db.attached(partial, "backup_copy") as moment:
            begin_copy(db, partial)
            tables = copy_all(db)
            span = _span(db, tables)
        return write_manifest(partial, target, tables, span, moment)


@contextmanager
def finished_copy(target: Path) -> Iterator[Path]:
    """Yield the name under which a new file and its manifest are written; both get their names when they are whole.

    Raises StoreError where the file exists or cannot be written.
    """
    check_database_name(str(target))
    refuse_existing(target)
    partial = target.with_name(target.name + ".partial")
    remove_partial(partial)
    try:
        yield partial
        refuse_log_apart(partial, target)
        # Both are on the disk before either has its name; the file has it last: without a manifest it is no backup.
        os.replace(manifest_of(partial), manifest_of(target))
        os.replace(partial, target)
        sync_folder(target.absolute().parent)
    except (OSError, duckdb.Error) as fault:
        raise StoreError(f"the backup {target} could not be written: {fault}") from fault
    finally:
        remove_partial(partial)


def begin_copy(db: Database, partial: Path) -> None:
    """Give a new file, before anything is in it, the mode of the database: who may read that may read its backup.

    Its owner may write it, also where nobody may write the database: DuckDB fills it.
    """
    mode = 0o600 if db.path == ":memory:" else stat.S_IMODE(os.stat(db.path).st_mode) & 0o666
    os.chmod(partial, mode | 0o600)
    make_log(str(partial))


def copy_all(db: Database) -> Checksums:
    """Copy everything into the attached ``backup_copy``; return rows and checksum of every table.

    Raises StoreError where the copy differs from the original.
    """
    ((catalog,),) = db.rows("SELECT current_database()")
    db.execute(f"COPY FROM DATABASE {quoted(catalog)} TO backup_copy")
    tables = checksums(db)
    copied = checksums(db, "backup_copy")
    if copied != tables:
        different = ", ".join(name for name in tables if copied.get(name) != tables[name])
        raise StoreError(f"the copy differs from the database in {different}; nothing was kept of it")
    return tables


def checksums(db: Database, catalog: str | None = None) -> Checksums:
    """Return rows and checksum of every table."""
    names = db.rows(
        "SELECT database_name, table_name FROM duckdb_tables() "
        "WHERE database_name = coalesce($catalog, current_database()) ORDER BY table_name",
        {"catalog": catalog},
    )
    sums = {}
    for database, table in names:
        ((rows, checksum),) = db.rows(
            "SELECT count(*), CAST(coalesce(sum(CAST(hash(t) AS HUGEINT)), 0) AS VARCHAR) "
            f"FROM {quoted(database)}.main.{quoted(table)} AS t"
        )
        sums[str(table)] = (int(rows), str(checksum))
    return sums


def audit_ends(db: Database) -> tuple[str, int, str, int]:
    """Return hash of the first entry, number and hash of the last, and the number of the last migration."""
    ((first, last, last_sha256),) = db.rows(
        "SELECT coalesce(min_by(entry_sha256, entry), ''), coalesce(max(entry), 0), "
        "coalesce(max_by(entry_sha256, entry), '') FROM audit"
    )
    ((schema,),) = db.rows("SELECT max(number) FROM schema_migration")
    return first, int(last), last_sha256, int(schema)


def quoted(name: str) -> str:
    """Return a name as SQL writes it."""
    return '"' + name.replace('"', '""') + '"'


def _span(db: Database, tables: Checksums) -> Span:
    first, last, last_sha256, schema = audit_ends(db)
    return Span(first, 1, last, last_sha256, schema, tables)
