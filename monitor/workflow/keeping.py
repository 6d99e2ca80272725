"""Keeping a database for years: audit, verification, backup, restore, export."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from monitor.exceptions import InputError
from monitor.store import (
    Database,
    export_tables,
    restore,
    take_backup,
    verify_audit,
)
from monitor.workflow.intake.campaigns import records

Document = dict[str, Any]


def verify(db: Database) -> Document:
    """Whether the database is as it was written."""
    found = verify_audit(db)
    return {
        "ok": found.ok,
        "entries": found.entries,
        "last_sha256": found.last_sha256,
        "faults": list(found.faults),
    }


def audit(db: Database, last: int) -> Document:
    """The last entries of the audit, the newest first. Raises InputError."""
    if not 0 < last < 2**63:
        raise InputError(f"--last {last}: how many entries, a whole number from 1 on")
    frame = db.frame(
        "SELECT entry, made_at, actor, action, subject, key, software_version FROM audit ORDER BY entry DESC LIMIT ?",
        [last],
    )
    return {"entries": records(frame)}


def backup(db: Database, target: Path) -> Document:
    """A second file with everything."""
    made = take_backup(db, target)
    rows = sum(count for count, _ in made.tables.values())
    return {
        "file": str(target),
        "sha256": made.sha256,
        "rows": rows,
        "message": f"{target}: {len(made.tables)} tables, {rows} rows, checked; its manifest lies beside it",
    }


def restore_to(source: Path, target: Path) -> Document:
    """A database from a backup."""
    made = restore(source, target)
    return {
        "file": str(target),
        "sha256": made.sha256,
        "message": f"{target} is the backup of {made.made_at[:19].replace('T', ' ')} UTC",
    }


def export(db: Database, folder: Path, form: Literal["csv", "parquet"]) -> Document:
    """All tables as files."""
    return {"files": [str(path) for path in export_tables(db, folder, form)]}
