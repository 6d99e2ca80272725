"""What is said of keeping a database: backups, restores, archives and its size."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path


def backup_made(file: Path, tables: int, rows: int) -> str:
    """Return what is said of a backup."""
    return f"{file}: {tables} tables, {rows} rows, checked; its manifest lies beside it"


def increment_made(file: Path, entries: tuple[int, int], rows: int, previous: str) -> str:
    """Return what is said of a backup of the ``entries`` of the audit since the ``previous`` one."""
    first, last = entries
    what = (
        f"entries {first} to {last} of the audit, {rows} rows since {previous}, which has to stay beside it"
    )
    return f"{file}: {what}, checked; its manifest lies beside it"


def nothing_to_back_up(file: Path, newest: str) -> str:
    """Return what is said of an incremental backup that would be empty."""
    return f"nothing is new since {newest}, the newest backup there; {file} was not made"


def backup_restored(file: Path, made_at: str, moment: datetime | None = None) -> str:
    """Return what is said of a database that was made from a backup (UTC), or as it was at a ``moment``."""
    if moment is not None:
        return f"{file} is the database as it was at {moment:%Y-%m-%d %H:%M:%S%z}"
    return f"{file} is the backup of {made_at} UTC"


def restored_up_to(entry: int, files: Sequence[str], *, verified: bool) -> str:
    """Return up to which entry of the audit and from which files a database was restored; faults may follow."""
    outcome = "; it was verified" if verified else "; its verification found:"
    return f", up to entry {entry} of the audit, from {', '.join(files)}{outcome}"


def anchor_unknown(anchor: str) -> str:
    """Return what is said where the audit lacks a hash that was kept elsewhere."""
    return (
        f"no entry of the audit has the hash {anchor}, which was kept elsewhere: the database was rewritten since, put "
        "back to an earlier state, or it is another database"
    )


def files_archived(folder: Path, files: int, campaigns: int, size: int, before: datetime) -> str:
    """Return what is said of files, of ``size`` bytes, that were moved into a folder; ``before`` is in UTC."""
    if not files:
        return f"nothing was imported before {before:%Y-%m-%d %H:%M:%S} UTC whose files are still in the database"
    return (
        f"{folder}: {files} files of {campaigns} campaigns moved there, {size / 1e6:.1f} MB; `monitor audit` says who "
        "and when, `monitor compact` gives the room back"
    )


def archive_checked(folder: Path, files: int, faults: int) -> str:
    """Return what is said of archived files that were looked at again."""
    state = f"{faults} are not as they were" if faults else "each is there with the hash in the database"
    return f"{folder}: {files} files were archived; {state}"


def compacted(file: str | Path, before: int, after: int, rows: int) -> str:
    """Return what is said of a database file that was written anew: bytes before and after, rows compared."""
    return f"{file}: {before / 1e6:.1f} MB before, {after / 1e6:.1f} MB now; {rows} rows, all compared"
