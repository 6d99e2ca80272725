"""Opens the database file, brings it to the present schema, and runs every change as one transaction.

One process that may write shuts every other out, readers too: that is DuckDB's rule, and the message names
the process. Within a process one ``Database`` may be shared by threads; its calls wait for one another.

Sums of doubles taken by several threads differ in the last bits from one time to the next. What is reported
is therefore computed with ``threads=1`` (or in numpy, in a fixed order).
"""

from __future__ import annotations

import copy
import re
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

import duckdb
import pandas as pd

from monitor.exceptions import StoreError
from monitor.store import migrations

Parameters = Sequence[Any] | Mapping[str, Any]
Record = TypeVar("Record")

_LOCKED = re.compile(r"Conflicting lock is held in (.*?) ?\(PID (\d+)\)")

#: A new file has its three headers of 4096 bytes each before anything else (DuckDB, storage format).
_HEADERS_BYTES = 3 * 4096
#: How long another process may take to write them, and how often it is looked at meanwhile.
_YOUNG_S, _LOOKS, _BETWEEN_LOOKS_S = 2.0, 10, 0.05


def utc_now() -> datetime:
    """Return the present moment in UTC without its zone, as every time is stored."""
    return datetime.now(UTC).replace(tzinfo=None)


class Database:
    """An open database; use it in a ``with`` statement.

    ``path`` is a file (made where there is none) or ":memory:". ``actor`` is who makes the changes, for the
    audit. Raises StoreError where the file cannot be opened, or does not fit this software.
    """

    def __init__(
        self, path: str | Path, *, read_only: bool = False, threads: int | None = None, actor: str = ""
    ) -> None:
        if threads is not None and threads < 1:
            raise StoreError(f"threads must be at least 1, not {threads}")
        self.path = str(path)
        self.read_only = read_only
        self.actor = actor
        self._lock = threading.RLock()
        self._writing = threading.RLock()
        self._in_transaction = False
        self._connection = _connect(self.path, read_only, threads)
        try:
            self._fit()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Database:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; other processes can open it then."""
        self._connection.close()

    def session(self, actor: str) -> Database:
        """Return a second view of the open file for another user; sessions read at the same time, and write in turn.

        Close it when it is no longer needed; the file stays open until this database is closed.
        """
        session = copy.copy(self)
        session.actor = actor
        session._lock = threading.RLock()
        session._in_transaction = False
        with self._lock:
            session._connection = self._connection.cursor()
        return session

    def confine(self, folder: Path) -> None:
        """Let queries of this file and its sessions read and write no other files than those below ``folder``.

        DuckDB's SQL reads any file that the process may read; what is asked over a network must not. It holds until
        the file is closed.
        """
        literal = str(folder.resolve()).replace("'", "''")
        with self._lock:
            self._connection.execute(f"SET allowed_directories = ['{literal}']")
            self._connection.execute("SET enable_external_access = false")
            self._connection.execute("SET lock_configuration = true")

    def execute(self, sql: str, parameters: Parameters = ()) -> None:
        """Run a statement. Values are always bound, never written into the text."""
        with self._lock, _stopped_by_ctrl_c():
            self._connection.execute(sql, parameters)

    def rows(self, sql: str, parameters: Parameters = ()) -> list[tuple[Any, ...]]:
        """Return the rows of a query as tuples."""
        with self._lock, _stopped_by_ctrl_c():
            return self._connection.execute(sql, parameters).fetchall()

    def records(self, kind: type[Record], sql: str, parameters: Parameters = ()) -> tuple[Record, ...]:
        """Return the rows of a query as records of a kind, whose fields are named as the columns."""
        with self._lock, _stopped_by_ctrl_c():
            cursor = self._connection.execute(sql, parameters)
            names = [column[0] for column in cursor.description or ()]
            return tuple(kind(**dict(zip(names, row, strict=True))) for row in cursor.fetchall())

    def frame(self, sql: str, parameters: Parameters = ()) -> pd.DataFrame:
        """Return the rows of a query as a table, for views that people read."""
        with self._lock, _stopped_by_ctrl_c():
            return self._connection.execute(sql, parameters).df()

    def arrays(self, sql: str, parameters: Parameters = ()) -> dict[str, Any]:
        """Return the columns of a query as numpy arrays, masked where NULL."""
        with self._lock, _stopped_by_ctrl_c():
            columns: dict[str, Any] = self._connection.execute(sql, parameters).fetchnumpy()
            return columns

    def insert(
        self, sql: str, incoming: Mapping[str, Any] | pd.DataFrame, parameters: Parameters = ()
    ) -> None:
        """Run an INSERT that selects from ``incoming``, columns by name: 50 times as quick as row by row."""
        with self._lock, _stopped_by_ctrl_c():
            self._connection.register("incoming", pd.DataFrame(incoming))
            try:
                self._connection.execute(sql, parameters)
            finally:
                self._connection.unregister("incoming")

    @contextmanager
    def connected(self) -> Iterator[duckdb.DuckDBPyConnection]:
        """Yield DuckDB's connection for this block; no other thread uses the database meanwhile."""
        with self._lock, _stopped_by_ctrl_c():
            yield self._connection

    def next_number(self, table: str, column: str) -> int:
        """Return one more than the largest number in use; call it inside the transaction that uses it."""
        ((number,),) = self.rows(f"SELECT coalesce(max({column}), 0) + 1 FROM {table}")
        return int(number)

    @contextmanager
    def attached(self, path: Path, name: str) -> Iterator[None]:
        """Attach a second database file under a name for this block; no other thread uses the database meanwhile."""
        with self._lock:
            literal = str(path).replace("'", "''")
            self._connection.execute(f"ATTACH '{literal}' AS {name} (READ_WRITE)")
            try:
                yield
            except BaseException:
                self._roll_back()
                raise
            finally:
                self._connection.execute(f"DETACH {name}")

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Store all changes of the block, or none where it fails.

        A transaction inside another joins it.
        """
        # In this order always: a thread that waits for its turn to write holds nothing that the writer needs.
        with self._writing, self._lock:
            if self.read_only:
                raise StoreError(f"{self.path} was opened for reading only; nothing can be changed")
            if self._in_transaction:
                yield
                return
            self._connection.begin()
            self._in_transaction = True
            try:
                yield
                self._connection.commit()
            except BaseException as fault:
                self._roll_back()
                # A disk that is full when the transaction ends is reported as a fault of the transaction.
                full = isinstance(fault, duckdb.TransactionException) and "Could not write file" in str(fault)
                if full or isinstance(fault, duckdb.IOException | duckdb.OutOfMemoryException):
                    raise StoreError(
                        f"{self.path} could not be written, nothing was kept: {fault}"
                    ) from fault
                raise
            finally:
                self._in_transaction = False

    def _roll_back(self) -> None:
        try:
            self._connection.rollback()
        except duckdb.Error:
            # A commit that failed has rolled back already.
            return

    def _fit(self) -> None:
        available = migrations.available()
        try:
            if not self.read_only:
                migrations.migrate(self._connection, available)
                return
            waiting = migrations.pending(self._connection, available)
        except StoreError as fault:
            raise StoreError(f"{self.path}: {fault}") from fault
        if waiting:
            raise StoreError(
                f"{self.path}: the database is older than this software and was opened for reading only; "
                "open it once for writing, which brings it to the present schema"
            )


@contextmanager
def _stopped_by_ctrl_c() -> Iterator[None]:
    """Raise KeyboardInterrupt for Ctrl-C during a query, which DuckDB reports as a fault of the query."""
    try:
        yield
    except RuntimeError as fault:
        if str(fault) == "Query interrupted":
            raise KeyboardInterrupt from fault
        raise


#: Of a new file, in bytes. One machine's history lies in as many blocks as it has campaigns, and a block is read whole:
#: a quarter of DuckDB's own size reads a fleet's machine in half the time, and a small file is a third as large.
BLOCK_SIZE = 65536


def _connect(path: str, read_only: bool, threads: int | None) -> duckdb.DuckDBPyConnection:
    # Nothing is fetched from the network behind the user's back.
    config: dict[str, str | bool | int | float | list[str]] = {
        "autoinstall_known_extensions": "false",
        "autoload_known_extensions": "false",
        "default_block_size": str(BLOCK_SIZE),
    }
    if threads is not None:
        config["threads"] = str(threads)
    for _ in range(_LOOKS):
        try:
            return duckdb.connect(path, read_only=read_only, config=config)
        except duckdb.Error as fault:
            if "not a valid DuckDB database file" not in str(fault) or not _is_being_made(path):
                raise StoreError(_in_words(path, read_only, str(fault))) from fault
            last = fault
            time.sleep(_BETWEEN_LOOKS_S)
    raise StoreError(_in_words(path, read_only, str(last))) from last


def _is_being_made(path: str) -> bool:
    """Whether a file that is no database yet may be one in a moment: another process makes it just now."""
    try:
        status = Path(path).stat()
    except OSError:
        return False
    return status.st_size < _HEADERS_BYTES and abs(time.time() - status.st_mtime) < _YOUNG_S


def _in_words(path: str, read_only: bool, message: str) -> str:
    locked = _LOCKED.search(message)
    if locked:
        return (
            f"{path} is in use by another process, {locked[1] or 'unknown'} (PID {locked[2]}); "
            "wait until it has finished, or stop it"
        )
    if "Could not set lock" in message:
        return f"{path} is in use by another process; wait until it has finished, or stop it"
    if "different configuration" in message:
        return f"{path} is open in this process already, with other options; close it first"
    if "not a valid DuckDB database file" in message:
        return f"{path} is not a database of this software; name another file, or one that does not exist yet"
    if read_only and "does not exist" in message:
        return f"there is no database {path}; `monitor --db {path} import FOLDER` makes one"
    if "No such file or directory" in message:
        return f"the folder of {path} does not exist; make it first"
    if "Is a directory" in message:
        return f"{path} is a folder; name a file"
    if "Permission denied" in message:
        return f"{path} may not be opened by this user: permission denied"
    return f"{path} cannot be opened: {message.splitlines()[0]}"
