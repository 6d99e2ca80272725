"""An open database: brought to the present schema, every change one transaction.

``Database`` has the file for as long as it is open, which shuts out whoever writes, and everybody else where it may
write itself: that is DuckDB's rule, and the message names the process. ``SharedDatabase`` (``sharing``) has it only
while it reads or writes. Within a process either may be shared by threads; its calls wait for one another.

Sums of doubles taken by several threads differ in the last bits from one time to the next. What is reported
is therefore computed with ``threads=1`` (or in numpy, in a fixed order).
"""

from __future__ import annotations

import contextlib
import copy
import threading
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar

import duckdb

from monitor.exceptions import StoreError
from monitor.stopping import checkpoint
from monitor.store import bound_values, migrations
from monitor.store.bound_values import Parameters
from monitor.store.database_name import check_database_name
from monitor.store.opening import (
    close_written,
    connect,
    damaged,
    is_missing,
    itself,
    make,
    make_empty,
    prepare_commit,
)
from monitor.store.recalling import Recalled
from monitor.store.turns import Patience

if TYPE_CHECKING:
    import pandas as pd

Record = TypeVar("Record")


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
        self.path = itself(str(path))
        self.read_only = read_only
        self.actor = actor
        self._threads = threads
        #: Limits of absolute values by machine type and parameter, in display units (``type_tolerances``).
        self.type_tolerances: Mapping[str, Mapping[str, float]] = {}
        self._lock = threading.RLock()
        self._one_writes = threading.RLock()  # of the sessions
        self._in_transaction = self._sees_one_moment = False
        self._remembered: list[str] = []
        #: What was read and may be read again, where this process alone has the file and says so; None: read anew.
        self.recalled: Recalled | None = None
        self._check_name()
        self._available = migrations.available()
        self._connection: duckdb.DuckDBPyConnection | None = None
        if not self.read_only and self.path != ":memory:" and is_missing(self.path):
            make(self.path, self.patience())
        self._open()

    def __enter__(self) -> Database:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; other processes can open it then."""
        with self._lock:
            if self._connection is not None:
                if self._may_have_written():
                    close_written(self._connection, self.path)
                else:
                    self._connection.close()

    def _may_have_written(self) -> bool:
        """Whether the connection that is open could write."""
        return not self.read_only

    def _check_name(self) -> None:
        """Refuse a name that is none of a database."""
        check_database_name(self.path)

    def patience(self) -> Patience:
        """How long another process is waited for."""
        return Patience()

    def _open(self) -> None:
        """Open the file for as long as the database is."""
        self._connection = connect(self.path, self.read_only, self._threads)
        try:
            self._fit(self._connection)
        except BaseException:
            self.close()
            raise

    @contextmanager
    def _used(self) -> Iterator[duckdb.DuckDBPyConnection]:
        """Yield the connection to one thread at a time; faults of the file in words, Ctrl-C as what it is."""
        checkpoint()
        with self._lock:
            if self._connection is None:
                raise StoreError(f"{self.path} is closed")
            with _in_words(self.path):
                yield self._connection

    @contextmanager
    def _writing(self) -> Iterator[duckdb.DuckDBPyConnection]:
        """Yield a connection that may write."""
        with self._used() as connection:
            yield connection

    @contextmanager
    def reading(self) -> Iterator[None]:
        """Show the database of one moment in this block, that of its first question; the block stores nothing.

        Other sessions go on storing meanwhile, which is not seen before the end. A block inside another is of the same
        moment.
        """
        with self._used() as connection:
            if self._in_transaction or self._sees_one_moment:
                yield
                return
            connection.begin()
            self._sees_one_moment = True
            try:
                yield
                connection.commit()
            except BaseException:
                _roll_back(connection)
                raise
            finally:
                self._sees_one_moment = False

    @contextmanager
    def snapshot(self) -> Iterator[datetime]:
        """Show, as ``reading``, the database of a moment (UTC) when nobody was storing anything; yield that moment.

        What is stored later has a later time in the audit.
        """
        # In the order of ``transaction``: the turn of those who write before the session's own lock.
        with ExitStack() as turn:
            turn.enter_context(self._one_writes)
            with self.reading():
                moment = self._moment()
                turn.close()
                yield moment

    def _moment(self) -> datetime:
        # A transaction of DuckDB sees what there is at its first question to a file.
        self.rows("SELECT 1 FROM audit LIMIT 0")
        return utc_now()

    @contextmanager
    def _kept(self) -> Iterator[None]:
        """Keep the file open in this block, for this thread alone."""
        with self._lock:
            yield

    def session(self, actor: str) -> Database:
        """Return a second view of the open file for another user; sessions read at the same time, and write in turn.

        Close it when it is no longer needed; the file stays open until this database is closed.
        """
        session = copy.copy(self)
        session.actor = actor
        session._lock = threading.RLock()
        session._in_transaction = session._sees_one_moment = False
        with self._used() as connection:
            session._connection = connection.cursor()
        return session

    def confine(self, folder: Path) -> None:
        """Let queries of this file and its sessions read and write no other files than those below ``folder``.

        DuckDB's SQL reads any file that the process may read; what is asked over a network must not. It holds until
        the file is closed.
        """
        literal = str(folder.resolve()).replace("'", "''")
        with self._used() as connection:
            connection.execute(f"SET allowed_directories = ['{literal}']")
            connection.execute("SET enable_external_access = false")
            connection.execute("SET lock_configuration = true")

    def execute(self, sql: str, parameters: Parameters = ()) -> None:
        """Run a statement. Values are always bound, never written into the text."""
        self._forget()
        with self._used() as connection:
            bound_values.execute(connection, sql, parameters)

    def set_variables(self, values: Mapping[str, Any]) -> None:
        """Give values to variables, which ``getvariable`` reads in statements that cannot be prepared."""
        with self._used() as connection:
            bound_values.set_variables(connection, values)

    def rows(self, sql: str, parameters: Parameters = ()) -> list[tuple[Any, ...]]:
        """Return the rows of a query as tuples."""
        with self._used() as connection:
            return bound_values.execute(connection, sql, parameters).fetchall()

    def records(self, kind: type[Record], sql: str, parameters: Parameters = ()) -> tuple[Record, ...]:
        """Return the rows of a query as records of a kind, whose fields are named as the columns."""
        with self._used() as connection:
            cursor = bound_values.execute(connection, sql, parameters)
            names = [column[0] for column in cursor.description or ()]
            return tuple(kind(**dict(zip(names, row, strict=True))) for row in cursor.fetchall())

    def frame(self, sql: str, parameters: Parameters = ()) -> pd.DataFrame:
        """Return the rows of a query as a table, for views that people read."""
        with self._used() as connection:
            return bound_values.execute(connection, sql, parameters).df()

    def arrays(self, sql: str, parameters: Parameters = ()) -> dict[str, Any]:
        """Return the columns of a query as numpy arrays, masked where NULL."""
        with self._used() as connection:
            columns: dict[str, Any] = bound_values.execute(connection, sql, parameters).fetchnumpy()
            return columns

    def insert(
        self, sql: str, incoming: Mapping[str, Any] | pd.DataFrame, parameters: Parameters = ()
    ) -> None:
        """Run an INSERT that selects from ``incoming``, columns by name: 50 times as quick as row by row."""
        # Loaded where something is written: whoever only reads does not wait for it.
        import pandas as pd

        self._forget()

        with self._used() as connection:
            connection.register("incoming", pd.DataFrame(incoming))
            try:
                bound_values.execute(connection, sql, parameters)
            finally:
                connection.unregister("incoming")

    @contextmanager
    def connected(self) -> Iterator[duckdb.DuckDBPyConnection]:
        """Yield DuckDB's connection for this block; no other thread uses the database meanwhile."""
        with self._used() as connection:
            try:
                yield connection
            finally:
                self._forget()

    def recall(self, key: Hashable, read: Callable[[], Record]) -> Record:
        """Return what ``read`` read before under a key, if nothing was written since.

        A transaction reads anew, and so does a block that sees a moment which may be past.
        """
        if self.recalled is None or self._in_transaction or self._sees_one_moment:
            return read()
        answer: Record = self.recalled.answer(key, read)
        return answer

    def _forget(self) -> None:
        if self.recalled is not None:
            self.recalled.forget()

    def next_number(self, table: str, column: str) -> int:
        """Return one more than the largest number in use; call it inside the transaction that uses it."""
        ((number,),) = self.rows(f"SELECT coalesce(max({column}), 0) + 1 FROM {table}")
        return int(number)

    @contextmanager
    def attached(self, path: Path, name: str) -> Iterator[datetime]:
        """Attach a second database file under a name for a block that sees a ``snapshot`` of the first.

        Yield its moment (UTC). No other thread uses this session meanwhile. Not to be called in ``reading``: a file is
        not detached before the moment is over. Where the configuration is locked (``confine``), others wait to write
        until the end: DuckDB 1.5 sets an option of its own where it copies a database within a transaction.
        """
        with ExitStack() as turn:
            turn.enter_context(self._one_writes)
            with self._kept(), self._used() as connection:
                literal = str(path).replace("'", "''")
                if not path.exists():
                    make_empty(str(path))
                connection.execute(f"ATTACH '{literal}' AS {name} (READ_WRITE)")
                try:
                    if self.rows("SELECT current_setting('lock_configuration')") == [(True,)]:
                        yield utc_now()
                        return
                    with self.reading():
                        moment = self._moment()
                        turn.close()
                        yield moment
                except BaseException:
                    _roll_back(connection)
                    raise
                finally:
                    _detach(connection, path, name)

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Store all changes of the block, or none where it fails.

        A transaction inside another joins it.
        """
        # In this order always: a thread that waits for its turn to write holds nothing that the writer needs.
        with self._one_writes, self._lock:
            if self.read_only:
                raise StoreError(f"{self.path} was opened for reading only; nothing can be changed")
            if self._in_transaction:
                yield
                return
            if self._sees_one_moment:
                raise StoreError(
                    "a block that reads the database of one moment stores nothing: store behind it"
                )
            with self._writing() as connection:
                connection.begin()
                self._in_transaction = True
                try:
                    yield
                    self._prepare_commit()
                    connection.commit()
                except BaseException as fault:
                    _roll_back(connection)
                    # A full disk or a folder that is not writable shows at the end, as a fault of the transaction.
                    at_end = isinstance(fault, duckdb.TransactionException) and "commit" in str(fault)
                    if at_end or isinstance(fault, duckdb.IOException | duckdb.OutOfMemoryException):
                        raise StoreError(
                            f"{self.path} could not be written, nothing was kept: {fault}"
                        ) from fault
                    raise
                finally:
                    self._in_transaction = False
                    self._forget()

    def _prepare_commit(self) -> None:
        prepare_commit(self.path)

    def _fit(self, connection: duckdb.DuckDBPyConnection) -> None:
        """Bring the schema to the present one; refuse a database that does not fit this software."""
        try:
            if not self.read_only:
                migrations.migrate(connection, self._available, before_commit=self._prepare_commit)
                return
            waiting = migrations.pending(connection, self._available)
        except StoreError as fault:
            raise StoreError(f"{self.path}: {fault}") from fault
        if waiting:
            raise StoreError(
                f"{self.path}: the database is older than this software and was opened for reading only; "
                "open it once for writing, which brings it to the present schema"
            )

    #: Whether it is a lake of many plants.
    is_lake = False

    @property
    def keeps_answers(self) -> bool:
        """Whether computed answers are stored; otherwise they are remembered until it is closed."""
        return True

    def storing_answer(self) -> AbstractContextManager[None]:
        """Store in this block what was computed from the database alone, as ``transaction`` does."""
        return self.transaction()

    def remember(self, document: str) -> int:
        """Remember an answer that is not stored; its number, below zero."""
        self._remembered.append(document)
        return -len(self._remembered)

    def remembered(self, number: int) -> str:
        """Return an answer that was remembered under a number."""
        return self._remembered[-number - 1]

    def is_same_campaign(self, name: str, number: int) -> bool:
        """Whether a name still is that of the campaign that it was before; always, where nobody else writes."""
        return True

    def forget_campaigns(self) -> None:
        """Let every name be that of another campaign from here on: after a withdrawal, and for a new question."""

    def begin_question(self) -> None:
        """Let a new question of a long session see what others stored since the last one."""
        self.forget_campaigns()


def _detach(connection: duckdb.DuckDBPyConnection, path: Path, name: str) -> None:
    """Close an attached file. Raises StoreError naming it where what it holds could not be written."""
    try:
        connection.execute(f"DETACH {name}")
    except duckdb.IOException as fault:
        raise StoreError(f"{path} could not be written, as on a full disk: {fault}") from fault


def _roll_back(connection: duckdb.DuckDBPyConnection) -> None:
    # A commit that failed has rolled back already; after a fault of the file nothing can be.
    with contextlib.suppress(duckdb.Error):
        connection.rollback()


@contextmanager
def _in_words(path: str) -> Iterator[None]:
    """Raise StoreError for a file that cannot be read, KeyboardInterrupt for Ctrl-C, a fault of the query to DuckDB."""
    try:
        yield
    except (
        duckdb.IOException,
        duckdb.FatalException,
        duckdb.SerializationException,
        duckdb.InternalException,
    ) as fault:
        raise StoreError(damaged(path, str(fault))) from fault
    except RuntimeError as fault:
        if str(fault) == "Query interrupted":
            raise KeyboardInterrupt from fault
        raise
