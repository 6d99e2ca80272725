"""The size of a database over the years: files moved out of it by a rule, and the file written anew without gaps."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from monitor.exceptions import InputError
from monitor.reporting import keeping_messages
from monitor.store import Database, archive_faults, archive_files, archived_count, check_machine, compact


@dataclass(frozen=True)
class ArchiveRequest:
    """Where the imported files go, and which: of campaigns imported ``before`` a moment, of one ``machine`` or all.

    Without a moment the archive is checked: every file that was taken out, against its hash. Raises InputError for a
    moment without its offset from UTC, or a machine without a moment.
    """

    folder: Path
    before: datetime | None = None
    machine: str | None = None

    def __post_init__(self) -> None:
        if self.before is not None and self.before.utcoffset() is None:
            raise InputError(f"--before {self.before}: name its offset from UTC")
        if self.before is None and self.machine is not None:
            raise InputError("--machine says whose files are moved: name --before as well")


@dataclass(frozen=True)
class ArchiveAnswer:
    """How many campaigns and files were moved, or checked, with their bytes; ``faults`` are those of a check."""

    campaigns: int
    files: int
    bytes: int
    message: str
    faults: tuple[str, ...] = ()


def archive(db: Database, request: ArchiveRequest) -> ArchiveAnswer:
    """Move imported files out of the database into a folder, or check those that were moved.

    Raises StoreError where one cannot be written or is there with other content, InputError for a lake, NotFoundError.
    """
    if db.is_lake:
        raise InputError(f"{db.path} is a lake of many plants: files are archived at the plant that has them")
    if request.before is None:
        with db.reading():
            faults, count = tuple(archive_faults(db, request.folder)), archived_count(db)
        message = keeping_messages.archive_checked(request.folder, count, len(faults))
        return ArchiveAnswer(0, count, 0, message, faults)
    if request.machine is not None:
        check_machine(db, request.machine)
    moment = request.before.astimezone(UTC).replace(tzinfo=None)
    moved = archive_files(db, request.folder, moment, machine=request.machine)
    message = keeping_messages.files_archived(
        request.folder, moved.files, moved.campaigns, moved.bytes, moment
    )
    return ArchiveAnswer(moved.campaigns, moved.files, moved.bytes, message)


@dataclass(frozen=True)
class CompactAnswer:
    """Size of the file before and after, in bytes, and its rows, compared table by table."""

    file: Path
    bytes_before: int
    bytes_after: int
    rows: int
    message: str


def compact_database(db: Database) -> CompactAnswer:
    """Write the database file anew without gaps. Raises StoreError, BusyError; InputError for a lake."""
    if db.is_lake:
        raise InputError(f"{db.path} is a lake: merge its files (docs/scale.md)")
    result = compact(db)
    message = keeping_messages.compacted(db.path, result.bytes_before, result.bytes_after, result.rows)
    return CompactAnswer(Path(db.path), result.bytes_before, result.bytes_after, result.rows, message)
