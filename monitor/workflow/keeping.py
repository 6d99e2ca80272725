"""Keeping a database for years: audit, verification, backup, restore, export."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from monitor.exceptions import InputError
from monitor.store import (
    AuditEntry,
    Database,
    export_tables,
    last_entries,
    restore,
    take_backup,
    verify_audit,
)


@dataclass(frozen=True)
class VerifyAnswer:
    """Whether the database is as it was written, with the hash of the last audit entry to be noted elsewhere."""

    ok: bool
    entries: int
    last_sha256: str
    faults: tuple[str, ...]


def verify(db: Database) -> VerifyAnswer:
    """Hash everything that is stored anew and compare it with the audit."""
    with db.reading():
        verification = verify_audit(db)
    return VerifyAnswer(verification.ok, verification.entries, verification.last_sha256, verification.faults)


@dataclass(frozen=True)
class AuditRequest:
    """How many of the last entries to list. Raises InputError where it is not a whole number from 1 on."""

    last: int

    def __post_init__(self) -> None:
        if not 0 < self.last < 2**63:
            raise InputError(f"--last {self.last}: how many entries, a whole number from 1 on")


@dataclass(frozen=True)
class AuditAnswer:
    """Entries of the audit, the newest first."""

    entries: tuple[AuditEntry, ...]


def audit(db: Database, request: AuditRequest) -> AuditAnswer:
    """List the last entries of the audit, the newest first."""
    return AuditAnswer(last_entries(db, request.last))


@dataclass(frozen=True)
class BackupRequest:
    """The new file that the database is copied to."""

    target: Path


@dataclass(frozen=True)
class BackupAnswer:
    """The copy with its hash, and how many rows it has in all tables."""

    file: Path
    sha256: str
    rows: int
    message: str


def backup(db: Database, request: BackupRequest) -> BackupAnswer:
    """Copy everything into a second file. Raises StoreError where it exists or cannot be written."""
    with db.reading():
        copy = take_backup(db, request.target)
    rows = sum(count for count, _ in copy.tables.values())
    return BackupAnswer(
        file=request.target,
        sha256=copy.sha256,
        rows=rows,
        message=f"{request.target}: {len(copy.tables)} tables, {rows} rows, checked; its manifest lies beside it",
    )


@dataclass(frozen=True)
class RestoreRequest:
    """A backup, and the new database that is made from it."""

    source: Path
    target: Path


@dataclass(frozen=True)
class RestoreAnswer:
    """The restored database with its hash."""

    file: Path
    sha256: str
    message: str


def restore_backup(request: RestoreRequest) -> RestoreAnswer:
    """Make a database from a backup. Raises StoreError where the backup is not what its manifest says."""
    source = restore(request.source, request.target)
    moment = source.made_at[:19].replace("T", " ")
    return RestoreAnswer(request.target, source.sha256, f"{request.target} is the backup of {moment} UTC")


@dataclass(frozen=True)
class ExportRequest:
    """A new or empty folder for the tables, and their format."""

    folder: Path
    format: Literal["csv", "parquet"] = "csv"


@dataclass(frozen=True)
class ExportAnswer:
    """The files that were written."""

    files: tuple[Path, ...]


def export(db: Database, request: ExportRequest) -> ExportAnswer:
    """Write all tables as files. Raises InputError for a folder that is not empty, StoreError."""
    with db.reading():
        return ExportAnswer(export_tables(db, request.folder, request.format))
