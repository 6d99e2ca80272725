"""Incremental backups: what was stored after the backup before, in a small file of the same tables.

The audit names everything that was ever stored, in order; an incremental backup holds the rows of the entries behind
the last one of the backup before (``entries``). Nothing that is stored is ever changed, so the rows of both are the
database: the counts of every table are compared when it is made, hashes of all rows when it is put back.
"""

from __future__ import annotations

from pathlib import Path

import duckdb

from monitor.exceptions import StoreError
from monitor.store.archiving import ACTION as ARCHIVE
from monitor.store.connection import Database
from monitor.store.copies.backup import audit_ends, begin_copy, checksums, finished_copy, quoted
from monitor.store.copies.manifest import (
    Backup,
    Checksums,
    Span,
    list_backups,
    note_current,
    refuse_existing,
    write_manifest,
)
from monitor.store.entries import rows_recorded, select_portion


def take_increment(db: Database, target: str | Path) -> Backup:
    """Write what was stored since the newest backup in the folder of ``target`` into that new file, with a manifest.

    Where nothing was, no file is made: that newest backup is returned, and its manifest says that it holds all until
    now.

    Raises StoreError where the folder has no backup that this database followed, or rows were stored otherwise.
    """
    target = Path(target)
    previous = _previous(db, target.absolute().parent)
    before = previous.span
    assert before is not None
    refuse_existing(target)
    with db.snapshot() as moment:
        if audit_ends(db)[1] == before.last_entry:
            _compare_counts(db, before.totals, previous.path)
            return note_current(target.with_name(previous.path), previous, moment)
    with finished_copy(target) as partial:
        with db.attached(partial, "increment") as moment:
            begin_copy(db, partial)
            database, last, last_sha256, schema = audit_ends(db)
            _copy_rows(db, before)
            tables = checksums(db, "increment")
            totals = _totals(before.totals, tables, previous.duckdb_version)
            _compare_counts(db, totals, previous.path)
        span = Span(
            database, before.last_entry + 1, last, last_sha256, schema, totals, previous.path, previous.sha256
        )
        return write_manifest(partial, target, tables, span, moment)


def _copy_rows(db: Database, before: Span) -> None:
    """Copy the rows of the entries behind the last of ``before`` into the attached ``increment``."""
    ((catalog,),) = db.rows("SELECT current_database()")
    with db.connected() as connection:
        select_portion(connection, quoted(catalog), before.last_entry + 1, audit_ends(db)[1])
        recorded = rows_recorded(connection)
    if "imported_campaign" in recorded:
        recorded["run_fingerprint"] = recorded["imported_campaign"]
    # Registrations are numbered from 1 without a gap.
    recorded["registered_machine"] = f"t.registration > {before.totals['registered_machine'][0]}"
    for table in before.totals:
        db.execute(
            f"CREATE TABLE increment.{quoted(table)} AS SELECT * FROM {quoted(catalog)}.main.{quoted(table)} AS t "
            f"WHERE {recorded.get(table, 'false')} ORDER BY t.rowid"
        )


def _previous(db: Database, folder: Path) -> Backup:
    """Return the newest backup in a folder that this database followed."""
    database, _, _, schema = audit_ends(db)
    of_this = [
        backup
        for backup in list_backups(folder)
        if backup.span is not None and (folder / backup.path).is_file() and backup.span.database == database
    ]
    if not database or not of_this:
        raise StoreError(
            f"{folder} has no backup of {db.path} that an incremental one could follow; make a full one there first: "
            "`monitor backup FILE`"
        )
    backup = of_this[-1]
    span = backup.span
    assert span is not None
    begin_anew = "make a full backup first: `monitor backup FILE`"
    if db.rows("SELECT entry_sha256 FROM audit WHERE entry = ?", [span.last_entry]) != [(span.last_sha256,)]:
        raise StoreError(
            f"{db.path} has another past than its newest backup {backup.path}: entry {span.last_entry} of its audit "
            f"is missing or has another hash. It was put back to an earlier state, or rewritten; {begin_anew}"
        )
    if span.schema != schema:
        raise StoreError(
            f"{backup.path} was made with an earlier schema of the database ({span.schema}, now {schema}); {begin_anew}"
        )
    ((taken_away,),) = db.rows(
        "SELECT count(*) FROM audit WHERE entry > ? AND action = ?", [span.last_entry, ARCHIVE]
    )
    if taken_away:
        raise StoreError(f"files of campaigns were archived since {backup.path} was made; {begin_anew}")
    return backup


def _totals(before: Checksums, added: Checksums, before_version: str) -> Checksums:
    """Return rows and checksum of every table of the whole database; no checksum after another version of DuckDB."""
    comparable = before_version == duckdb.__version__ and all(checksum for _, checksum in before.values())
    return {
        table: (
            rows + added[table][0],
            str(int(checksum) + int(added[table][1])) if comparable else "",
        )
        for table, (rows, checksum) in before.items()
    }


def _compare_counts(db: Database, totals: Checksums, previous: str) -> None:
    """Raise StoreError where the backup before and the rows that follow are not all rows of the database."""
    for table, (expected, _) in totals.items():
        ((rows,),) = db.rows(f"SELECT count(*) FROM {quoted(table)}")
        if rows != expected:
            raise StoreError(
                f"the table {table} has {rows} rows; {previous} and what the audit names since then are {expected}. "
                "See `monitor verify`, then make a full backup: `monitor backup FILE`"
            )
