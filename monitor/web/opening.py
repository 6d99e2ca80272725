"""Opens the database that is served: one process holds the file, each request its own session of it.

Of a file that may be read and not written a private copy is served to viewers, which keeps nobody from the file; once
somebody else wrote it, the next question is answered from a new copy.
"""

from __future__ import annotations

import getpass
import shlex
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

from monitor.exceptions import InputError, NotFoundError
from monitor.store import Database, Recalled
from monitor.store.unwritable import copy_of_one_moment, state_of_file, why_not_written


def host_user_name() -> str:
    """Return the name of the account that the server runs under; a container may run under a number without a name."""
    with suppress(OSError, KeyError):
        return getpass.getuser()
    return "somebody"


@dataclass(frozen=True)
class Served:
    """An open database. ``unwritten`` is why the file may not be written, None where it may: then ``newer`` returns
    another database once somebody else wrote the file, else None."""

    db: Database
    unwritten: str | None = None
    newer: Callable[[], Database | None] | None = None


class _Copies:
    """Copies of a file, each of one moment. Two stay open: a question may still be asking the one before."""

    def __init__(self, path: str, working_folder: Path) -> None:
        self._path, self._working_folder = path, working_folder
        self._lock = Lock()
        self._open: list[ExitStack] = []
        self._state: tuple[tuple[int, ...], ...] | None = None

    def newer(self) -> Database | None:
        """Return a database of the file as it is now; None where it is as the last one had it."""
        with self._lock:
            state = state_of_file(self._path)
            if state == self._state:
                return None
            with ExitStack() as copied:
                copy = copied.enter_context(copy_of_one_moment(self._path))
                db = copied.enter_context(_confined(copy, self._working_folder))
                self._open.append(copied.pop_all())
            self._state = state
            if len(self._open) > 2:
                self._open.pop(0).close()
            return db

    def close(self) -> None:
        for copied in self._open:
            copied.close()


@contextmanager
def _confined(path: str | Path, working_folder: Path) -> Iterator[Database]:
    with Database(path, threads=1, actor=host_user_name()) as db:
        db.confine(working_folder)
        db.recalled = Recalled()
        yield db


@contextmanager
def opened(path: Path, working_folder: Path, *, must_exist: bool = False) -> Iterator[Served]:
    """Open the database; its queries reach files in ``working_folder`` alone. Raises NotFoundError, InputError for
    a lake, StoreError."""
    if str(path).startswith("ducklake:"):
        raise InputError(
            "serve shows one database file, not a lake of many plants: serve the file of a plant, or ask the lake by "
            "the verbs that read, such as monitor --db ducklake:... fleet"
        )
    if must_exist and not path.exists():
        raise NotFoundError(
            f"there is no database {path}; `monitor --db {shlex.quote(str(path))} import FOLDER` makes one"
        )
    why = why_not_written(str(path))
    if why is None:
        with _confined(path, working_folder) as db:
            yield Served(db)
        return
    copies = _Copies(str(path), working_folder)
    try:
        first = copies.newer()
        assert first is not None, "the first look is of no state that was seen"
        yield Served(first, why, copies.newer)
    finally:
        copies.close()
