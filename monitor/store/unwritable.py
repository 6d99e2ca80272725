"""A file that may be read and not written: its questions are answered, and the answers not stored.

What an answer is made of is mostly not asked for again, and is remembered until the session ends. Identifications are:
the trend, the statistics, the report read what was identified a moment before. They are stored in a private copy of the
file, which ends with the session, too, or with the first question after somebody else wrote the file.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from monitor.exceptions import StoreError
from monitor.store.kept_blocks import own_descriptor
from monitor.store.opening import connect

#: How much of a file is copied at once, in bytes.
_PIECE = 2**24


def why_not_written(path: str) -> str | None:
    """Return in words why a file may not be written by this user; None where it may, or is not there."""
    if path == ":memory:" or not os.path.exists(path):
        return None
    if os.stat(path).st_nlink > 1:
        return f"{path} has several names (hard links)"
    folder = os.path.dirname(os.path.abspath(path))
    if _may_write(path) and _may_write(folder):
        return None
    return f"{folder if _may_write(path) else path} may not be written by this user"


def state_of_file(path: str) -> tuple[tuple[int, ...], ...]:
    """Return what differs once somebody wrote a file or its log, or put another in its place; empty of what is not
    there."""
    states: list[tuple[int, ...]] = []
    for name in (path, path + ".wal"):
        try:
            status = os.stat(name)
        except OSError:
            states.append(())
        else:
            states.append((status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns))
    return tuple(states)


def _may_write(path: str) -> bool:
    # Of who the process acts for, where the system knows that.
    return os.access(path, os.W_OK, effective_ids=os.access in os.supports_effective_ids)


@contextmanager
def private_copy(path: str) -> Iterator[str]:
    """Yield the name of a copy that nobody else may read, with its log; this process has the file open to read.

    It is removed behind the block. Raises StoreError where there is no room for it.
    """
    with ExitStack() as copied:
        try:
            folder = copied.enter_context(
                tempfile.TemporaryDirectory(prefix="monitor-", ignore_cleanup_errors=True)
            )
            copy = os.path.join(folder, "copy.duckdb")
            if os.path.exists(path + ".wal"):
                shutil.copyfile(path + ".wal", copy + ".wal")
            _copy(path, copy)
        except OSError as fault:
            raise StoreError(
                f"{path} may not be written by this user, and there is no room for the copy in the temporary folder "
                f"(TMPDIR) that this question needs: {fault.strerror}"
            ) from fault
        yield copy


@contextmanager
def copy_of_one_moment(path: str) -> Iterator[str]:
    """Yield the name of a private copy of a file that this process has not open; who writes it is waited for.

    Raises StoreError where the file cannot be read, or there is no room.
    """
    with ExitStack() as copied:
        connection = connect(path, True, None)
        try:
            copy = copied.enter_context(private_copy(path))
        finally:
            connection.close()
        yield copy


def _copy(path: str, copy: str) -> None:
    """Copy a file through the descriptor that the process has: to close another would end its locks (POSIX)."""
    descriptor = own_descriptor(path)
    if descriptor is None:
        shutil.copyfile(path, copy)
        return
    with open(copy, "wb") as target:
        begin = 0
        while piece := os.pread(descriptor, _PIECE, begin):
            target.write(piece)
            begin += len(piece)
