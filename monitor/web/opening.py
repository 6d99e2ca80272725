"""Opens the database that is served: one process holds the file, each request its own session of it.

Of a file that may be read and not written a private copy is served to viewers, which keeps nobody from the file; once
somebody else wrote it, the next question is answered from a new copy.
"""

from __future__ import annotations

import getpass
import shlex
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
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


class Copies:
    """Copies of a file that is read and not written, each of one moment: who asks has the newest, as long as they ask.

    A copy ends, and its file with it, once a newer one is there and its last question is answered.
    """

    def __init__(self, path: str, working_folder: Path) -> None:
        self._path, self._working_folder = path, working_folder
        #: Held while a copy is made; whoever asks meanwhile waits for it.
        self._making = Lock()
        #: Held while the newest copy becomes another, and while the questions of a copy are counted.
        self._lock = Lock()
        self._state = state_of_file(path)
        self._newest = self._made()
        self._open = [self._newest]

    @property
    def db(self) -> Database:
        """The newest copy; use ``asked`` for whatever takes longer than a look."""
        return self._newest.db

    def follow(self, noted: Callable[[], None]) -> None:
        """Have questions answered from the file as it is now; ``noted`` is called before any is asked of a new copy.

        Raises StoreError where the file cannot be copied.
        """
        with self._making:
            state = state_of_file(self._path)
            if state == self._state:
                return
            copy = self._made()
            copy.db.type_tolerances = self._newest.db.type_tolerances
            with self._lock:
                before, self._newest = self._newest, copy
                self._open.append(copy)
                self._state = state
                noted()
                is_idle = before.questions == 0
                if is_idle:
                    self._open.remove(before)
            if is_idle:
                before.held.close()

    @contextmanager
    def asked(self) -> Iterator[Database]:
        """Yield the newest copy, which stays open for the block."""
        with self._lock:
            copy = self._newest
            copy.questions += 1
        try:
            yield copy.db
        finally:
            with self._lock:
                copy.questions -= 1
                is_last = copy.questions == 0 and copy is not self._newest and copy in self._open
                if is_last:
                    self._open.remove(copy)
            if is_last:
                copy.held.close()

    def close(self) -> None:
        """End all copies."""
        with self._lock:
            ending, self._open = self._open, []
        for copy in ending:
            copy.held.close()

    def _made(self) -> _Copy:
        with ExitStack() as copied:
            path = copied.enter_context(copy_of_one_moment(self._path))
            db = copied.enter_context(_confined(path, self._working_folder))
            return _Copy(db, copied.pop_all())


@dataclass(eq=False)
class _Copy:
    """A copy that is open, what it holds, and how many ``questions`` are being asked of it."""

    db: Database
    held: ExitStack
    questions: int = 0


@dataclass(frozen=True)
class Served:
    """An open database. ``unwritten`` is why the file may not be written, None where it may: then ``copies`` are asked,
    of which ``db`` is the first."""

    db: Database
    unwritten: str | None = None
    copies: Copies | None = None


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
    with closing(Copies(str(path), working_folder)) as copies:
        yield Served(copies.db, why, copies)
