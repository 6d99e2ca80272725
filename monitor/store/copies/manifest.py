"""What a backup says of itself: a manifest beside its file, with hashes, and which entries of the audit it holds."""

from __future__ import annotations

import hashlib
import json
import os
import stat
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from pathlib import Path

import duckdb

from monitor import __version__
from monitor.bounded import LARGEST_DOCUMENT, read_bounded
from monitor.exceptions import StoreError
from monitor.store.kept_blocks import ENDING
from monitor.store.opening import refuse_log_left, sync_folder

_MANIFEST_END = ".manifest.json"
#: What the name of a backup ends with until it is whole.
_PARTIAL_END = ".partial"

#: Rows and checksum by table.
Checksums = Mapping[str, tuple[int, str]]


@dataclass(frozen=True)
class Span:
    """The entries of an audit that a backup holds, and what the database was after the last of them.

    ``database`` is the hash of its first entry, by which it is known; "" before there is one. ``schema`` is the number
    of the last migration. ``totals`` are rows and checksum of every table of the whole database. ``previous`` is the
    name of the backup, in the same folder, that an incremental one follows; None of a full one.
    """

    database: str
    first_entry: int
    last_entry: int
    last_sha256: str
    schema: int
    totals: Checksums
    previous: str | None = None
    previous_sha256: str | None = None


@dataclass(frozen=True)
class Backup:
    """A backup: its file and hash, the moment that it shows (UTC), and rows and checksum of every table in the file.

    The checksum is DuckDB's own hash, summed over the rows; it compares tables within ``duckdb_version`` only. ``span``
    is None where version 0.2.0 or an earlier one made it. ``current_at`` is when an incremental backup last had nothing
    to add to it; None where none was asked for since.
    """

    path: str
    sha256: str
    made_at: str
    software_version: str
    duckdb_version: str
    tables: Checksums
    span: Span | None = None
    current_at: str | None = None

    @property
    def holds_until(self) -> str:
        """The last moment (UTC) of which it is known to hold everything."""
        return self.current_at or self.made_at


def write_manifest(partial: Path, target: Path, tables: Checksums, span: Span, moment: datetime) -> Backup:
    """Return the manifest of a file that is to be named ``target``, written beside it and synchronised with it.

    ``moment`` (UTC) is that of the database which the file shows.
    """
    backup = Backup(
        target.name,
        file_sha256(partial),
        moment.isoformat(),
        __version__,
        duckdb.__version__,
        tables,
        span,
    )
    _write(backup, partial)
    sync(partial)
    return backup


def note_current(path: Path, backup: Backup, moment: datetime) -> Backup:
    """Write into the manifest of a backup that it holds everything until a moment (UTC). Raises StoreError."""
    partial = path.with_name(path.name + ".partial")
    renewed = replace(backup, current_at=moment.isoformat())
    try:
        manifest_of(partial).unlink(missing_ok=True)
        _write(renewed, partial, stat.S_IMODE(os.stat(path).st_mode))
        os.replace(manifest_of(partial), manifest_of(path))
        sync_folder(path.absolute().parent)
    except OSError as fault:
        raise StoreError(f"the manifest of {path} could not be written: {fault}") from fault
    return renewed


def _write(backup: Backup, partial: Path, mode: int | None = None) -> None:
    """Write a manifest beside a file, for those who may read the file, onto the disk. Raises OSError."""
    path = manifest_of(partial)
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as file:
        file.write(json.dumps(asdict(backup), indent=1, ensure_ascii=False) + "\n")
    # Who may read the backup may read what it has to be compared with.
    os.chmod(path, stat.S_IMODE(os.stat(partial).st_mode) if mode is None else mode)
    sync(path)


def manifest_of(path: Path) -> Path:
    """Return where the manifest of a file lies."""
    return path.with_name(path.name + _MANIFEST_END)


def read_manifest(path: Path) -> Backup:
    """Return what a manifest says. Raises StoreError for what is none."""
    try:
        manifest = json.loads(read_bounded(path, LARGEST_DOCUMENT))
        span = manifest.pop("span", None)
        return Backup(
            **manifest | {"tables": _checksums(manifest["tables"])},
            span=None if span is None else Span(**span | {"totals": _checksums(span["totals"])}),
        )
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as fault:
        raise StoreError(f"{path} is not a manifest of a backup: {fault}") from fault


def list_backups(folder: str | Path) -> tuple[Backup, ...]:
    """The backups in a folder that have a manifest, the oldest first; not what a killed one left unfinished.

    One that follows another stands behind it, also where the clock was set back in between.
    """
    backups = [
        read_manifest(path)
        for path in Path(folder).glob(f"*{_MANIFEST_END}")
        if not path.name.endswith(_PARTIAL_END + _MANIFEST_END)
    ]
    by_name = {backup.path: backup for backup in backups}

    def order(backup: Backup) -> tuple[str, int, str]:
        times, entries = [], 0 if backup.span is None else backup.span.last_entry
        follows: Backup | None = backup
        # As many steps as there are backups: manifests that follow in a circle are refused where they are read.
        for _ in backups:
            if follows is None:
                break
            times.append(follows.made_at)
            previous = None if follows.span is None else follows.span.previous
            follows = None if previous is None else by_name.get(Path(previous).name)
        return max(times), entries, backup.path

    return tuple(sorted(backups, key=order))


def remove_partial(partial: Path) -> None:
    """Remove what was not finished: the file, its log and its manifest."""
    beside = (partial.with_name(partial.name + ending) for ending in (".wal", ENDING))
    for path in (partial, *beside, manifest_of(partial)):
        path.unlink(missing_ok=True)


def refuse_existing(target: Path) -> None:
    """Raise StoreError where a file is there already, or the log of one that was, or its folder is not."""
    if target.exists():
        raise StoreError(f"{target} exists already; name a new file, or move that one away first")
    if not target.absolute().parent.is_dir():
        raise StoreError(f"the folder of {target} does not exist; make it first")
    refuse_log_left(target)


def sync(path: Path) -> None:
    """Write a file to the disk."""
    # Open for writing: Windows synchronises no file that is open for reading alone.
    with path.open("r+b") as file:
        os.fsync(file.fileno())


def file_sha256(path: Path) -> str:
    """Return the SHA-256 of a file, hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _checksums(tables: Mapping[str, tuple[int, str]]) -> Checksums:
    return {name: (int(rows), str(checksum)) for name, (rows, checksum) in tables.items()}
