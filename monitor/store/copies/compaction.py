"""Compaction: the database written anew into a file without gaps, which takes the place of the old one.

DuckDB uses the room of rows that are gone again, and gives none of it back. The new file is compared with the old one
table by table, is on the disk before it gets the name, and whoever reads meanwhile goes on with the old one.
"""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import duckdb

from monitor.exceptions import StoreError
from monitor.store.connection import Database
from monitor.store.copies.backup import begin_copy, copy_all
from monitor.store.copies.manifest import remove_partial, sync
from monitor.store.opening import busy, refuse_log_apart, sync_folder
from monitor.store.turns import turn_to_write
from monitor.store.unwritable import why_not_written

try:
    import fcntl
except ImportError:  # Windows refuses to rename over an open file: no other process has it open then
    _LOCKS = False
else:
    _LOCKS = True


@dataclass(frozen=True)
class Compaction:
    """Size of the file before and after, in bytes, and its rows in all tables, which stay what they were."""

    bytes_before: int
    bytes_after: int
    rows: int


def compact(db: Database) -> Compaction:
    """Write the database of a file anew and let the new file take its place; ``db`` is closed.

    Raises BusyError while another process has the file, StoreError where it cannot be written.
    """
    if db.path == ":memory:":
        raise StoreError("a database in memory has no file to be written anew")
    if (why := why_not_written(db.path)) is not None:
        raise StoreError(f"{why}; it stays as it was")
    path = Path(db.path).resolve()
    partial = path.with_name(path.name + ".partial")
    db.close()
    with turn_to_write(db.path, db.patience()) as holder:
        if holder is not None:
            raise busy(db.path, holder, db.patience())
        remove_partial(partial)
        try:
            # Whoever has the file open for writing keeps it: DuckDB's own lock refuses this opening.
            with Database(db.path) as original:
                with original.attached(partial, "backup_copy"):
                    begin_copy(original, partial)
                    tables = copy_all(original)
                original.execute("CHECKPOINT")
                before = os.stat(path)
            refuse_log_apart(partial, f"{path}, anew,")
            sync(partial)
            with _still(path, Path(db.path + ".wal"), before):
                _same_owner(partial, before)
                os.replace(partial, path)
                sync_folder(path.parent)
        except (OSError, duckdb.Error) as fault:
            raise StoreError(f"{path} could not be written anew, it stays as it was: {fault}") from fault
        finally:
            remove_partial(partial)
    return Compaction(before.st_size, path.stat().st_size, sum(rows for rows, _ in tables.values()))


@contextmanager
def _still(path: Path, log: Path, before: os.stat_result) -> Iterator[None]:
    """Keep clients that take no turn out of a file for this block; refuse where one wrote into it meanwhile."""
    with contextlib.ExitStack() as opened:
        file = opened.enter_context(path.open("r+b"))
        if _LOCKS:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        present = os.stat(path)
        if (present.st_ino, present.st_size, present.st_mtime_ns) != (
            before.st_ino,
            before.st_size,
            before.st_mtime_ns,
        ) or (log.exists() and log.stat().st_size):
            raise StoreError(f"another process wrote into {path} meanwhile; it stays as it was, ask again")
        if not _LOCKS:
            opened.close()  # Windows renames over no file that is open, by this process either
        yield


def _same_owner(partial: Path, before: os.stat_result) -> None:
    if hasattr(os, "chown"):
        with contextlib.suppress(OSError):
            os.chown(partial, before.st_uid, before.st_gid)
    os.chmod(partial, stat.S_IMODE(before.st_mode))
