"""The database that a verb works on: named by ``--db``, opened under the name of the user who typed the verb.

Where a server has it, the server is asked instead: that of ``--server``, or the one whose note lies beside the file.
"""

from __future__ import annotations

import getpass
import os
import shlex
import sys
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar

from monitor.cli.configuration import configuration
from monitor.cli.secret_files import warn_of_readers
from monitor.exceptions import InputError, NotFoundError

if TYPE_CHECKING:
    from monitor.store import Database
    from monitor.web.client import Server

Answer = TypeVar("Answer")
Further = ParamSpec("Further")


def is_lake(address: str) -> bool:
    """Whether --db names a lake of many plants, and no file."""
    return address.startswith("ducklake:")


#: How long a verb waits for another process that has the database, in s; ``--wait`` says otherwise.
PATIENCE_S = 300.0


def opened(options: Namespace, *, threads: int | None = None, judging: bool = False) -> Database | Server:
    """The open database, held only while it is read or written, or the server that has it.

    The audit says who changed it. ``judging``: with the tolerances by machine type of the configuration. Raises
    StoreError, InputError.
    """
    server = _server(options, (configuration().tolerances or {}) if judging else None)
    return server if server is not None else opened_file(options, threads=threads, judging=judging)


def ask(
    db: Database | Server, question: Callable[Concatenate[Database, Further], Answer],
    *request: Further.args, **further: Further.kwargs,
) -> Answer:  # fmt: skip
    """Return the answer to a question of the contract, of the database or of the server that has it."""
    from monitor.store import Database

    if isinstance(db, Database):
        return question(db, *request, **further)
    # What shows the progress of a verb does not travel.
    answer: Answer = db.answer(_name_of(question), *request)
    return answer


def _name_of(function: Callable[..., Any]) -> str:
    """Return the name under which a function stands in the contract."""
    from monitor.workflow.contract import QUESTIONS

    stands = f"{function.__module__.removeprefix('monitor.workflow.')}:{function.__name__}"
    return next(question.name for question in QUESTIONS.values() if question.function == stands)


def _server(options: Namespace, tolerances: Any) -> Server | None:
    """Return the server that is named, or whose note lies beside the database; None where the file is opened here."""
    if options.server is not None:
        from monitor.web.client import Server, address_of_server, token_in

        file = options.server_token or os.environ.get("MONITOR_SERVER_TOKEN_FILE")
        token = os.environ.get("MONITOR_SERVER_TOKEN") if not file else token_in(Path(file))
        if file:
            warn_of_readers(Path(file))
        return Server(address_of_server(options.server), token, tolerances=tolerances)
    note = served_by(options.db)
    if note is None:
        return None
    from monitor.web.client import server_of_note

    return server_of_note(note, tolerances)


def served_by(database: str) -> Any:
    """Return the note of the server that has a database now, of the same account; None where there is none."""
    # Asked before anything is loaded: hardly any database is served. A name with a NUL in it is refused later.
    if "\0" in database or not os.path.lexists(f"{os.path.realpath(database)}.server"):
        return None
    from monitor.web.note import read_note

    return read_note(database)


def refuse_server(options: Namespace, why: str) -> None:
    """Refuse a verb that works on the database file itself while a server has it. Raises InputError."""
    if options.server is not None:
        raise InputError(f"this cannot be asked of a server: {why}")
    note = served_by(options.db)
    if note is not None:
        raise InputError(
            f"{options.db} is served at {note.address} (PID {note.pid}), and this cannot be asked of a server: {why}"
        )


def opened_file(options: Namespace, *, threads: int | None = None, judging: bool = False) -> Database:
    """The open database file itself. Raises StoreError, InputError."""
    # Loaded here: `monitor --help` answers without a database engine.
    from monitor.store import Holder, Patience, SharedDatabase

    def report(holder: Holder, seconds: float) -> None:
        print(
            f"monitor: {options.db} is in use by {holder}; waiting up to {seconds:.0f} s more",
            file=sys.stderr,
            flush=True,
        )

    if is_lake(options.db):
        from monitor.store.lake.reading import LakeDatabase

        lake = LakeDatabase(options.db, threads=threads, actor=_user())
        if judging:
            lake.type_tolerances = configuration().tolerances or {}
        return lake

    def say_unstored(why: str) -> None:
        print(f"monitor: {why}", file=sys.stderr, flush=True)

    patience = Patience(options.wait, report)
    db = SharedDatabase(options.db, threads=threads, actor=_user(), patience=patience, unstored=say_unstored)
    if judging:
        db.type_tolerances = configuration().tolerances or {}
    return db


def seconds_to_wait(text: str) -> float:
    """Read the value of ``--wait``. Raises InputError where it is no number of seconds."""
    try:
        seconds = float(text)
    except ValueError:
        seconds = -1.0
    if not 0 <= seconds <= 86400:
        raise InputError(
            f"--wait {text}: how many seconds to wait for the database, a number from 0 to 86400"
        )
    return seconds


def check_path(path: str, *, may_be_new: bool) -> None:
    """Refuse what would be forgotten when the verb ends, and a file that is not there where none is to be made.

    A mistyped name would otherwise leave an empty database behind. Raises InputError, NotFoundError.
    """
    if is_lake(path):
        return
    if not path.strip() or path.startswith(":memory:"):
        raise InputError(f"--db '{path}' names no file; name one, for example --db monitor.duckdb")
    if not may_be_new and not Path(path).exists():
        # Loaded here, on the way to a refusal: `monitor --help` answers without a database engine.
        from monitor.store import check_database_name

        check_database_name(path)
    if not may_be_new and Path(path).parent.is_dir() and not Path(path).exists():
        raise NotFoundError(
            f"there is no database {path}; `monitor --db {shlex.quote(str(path))} import FOLDER` makes one"
        )
    if not may_be_new and Path(path).is_file() and Path(path).stat().st_size == 0:
        raise NotFoundError(
            f"{path} is an empty file, as a full disk leaves one: restore a backup with `monitor --db OTHER restore "
            f"BACKUP`; where there was no database yet, `monitor --db {shlex.quote(str(path))} import FOLDER` makes one"
        )


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        # A container may run under a number that has no name; Windows has no list of users to ask.
        return ""
