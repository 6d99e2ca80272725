"""Opens the database that is served: one process holds the file, each request its own session of it."""

from __future__ import annotations

import getpass
import shlex
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from monitor.exceptions import InputError, NotFoundError
from monitor.store import Database, Recalled


def host_user_name() -> str:
    """Return the name of the account that the server runs under; a container may run under a number without a name."""
    with suppress(OSError, KeyError):
        return getpass.getuser()
    return "somebody"


@contextmanager
def opened(path: Path, working_folder: Path, *, must_exist: bool = False) -> Iterator[Database]:
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
    with Database(path, threads=1, actor=host_user_name()) as db:
        db.confine(working_folder)
        db.recalled = Recalled()
        yield db
