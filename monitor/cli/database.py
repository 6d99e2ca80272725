"""The database that a verb works on: named by ``--db``, opened under the name of the user who typed the verb."""

from __future__ import annotations

import getpass
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from monitor.exceptions import InputError, NotFoundError

if TYPE_CHECKING:
    from monitor.store import Database


def opened(options: Namespace, *, threads: int | None = None) -> Database:
    """The open database; the audit says who changed it. Raises StoreError."""
    # Loaded here: `monitor --help` answers without a database engine.
    from monitor.store import Database

    return Database(options.db, threads=threads, actor=_user())


def check_path(path: str, *, may_be_new: bool) -> None:
    """Refuse what would be forgotten when the verb ends, and a file that is not there where none is to be made.

    A mistyped name would otherwise leave an empty database behind. Raises InputError, NotFoundError.
    """
    if not path.strip() or path.startswith(":memory:"):
        raise InputError(f"--db '{path}' names no file; name one, for example --db monitor.duckdb")
    if not may_be_new and not Path(path).exists():
        # Loaded here, on the way to a refusal: `monitor --help` answers without a database engine.
        from monitor.store import check_database_name

        check_database_name(path)
    if not may_be_new and Path(path).parent.is_dir() and not Path(path).exists():
        raise NotFoundError(f"there is no database {path}; `monitor --db {path} import FOLDER` makes one")


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        # A container may run under a number that has no name.
        return ""
