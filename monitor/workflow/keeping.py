"""Keeping a database for years: events, audit, verification, backup, restore, export."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Literal

from monitor.exceptions import InputError, NotFoundError
from monitor.store import (
    Database,
    export_tables,
    list_events,
    list_machines,
    record_event,
    restore,
    take_backup,
    verify_audit,
)
from monitor.workflow.intake.campaigns import records

Document = dict[str, Any]


def record(db: Database, machine: str, at: datetime, kind: str, text: str) -> int:
    """Record what happened to a machine. Raises InputError without words, NotFoundError."""
    if not text.strip():
        raise InputError("say in words what happened, for example 'B axis encoder changed'")
    if at > datetime.now(UTC) + timedelta(hours=1):
        raise InputError(
            f"{at.isoformat()} lies in the future, and an event cannot be undone; give the time it had"
        )
    return record_event(db, machine, at, kind, text)


def events(db: Database, machine: str | None = None) -> Document:
    """What was recorded of a machine, or of all. Raises NotFoundError for an unknown machine."""
    known = [str(name) for name in list_machines(db)["machine"]]
    if machine is not None and machine not in known:
        raise NotFoundError(f"there is no machine {machine!r}; there are {', '.join(known) or 'none yet'}")
    return {"events": records(list_events(db, machine))}


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
