"""A database whose file is held only while it is read or written, so that many processes work beside each other.

It is opened for reading at the first question and let go when nothing was asked for a moment, so that a fit or a page
that is rendered keeps nobody waiting. A transaction takes the turn to write (``turns``), waits until those who read
have left, and lets go soon after. Both waits end with ``patience``, in words that name the process.

Between two questions others may add rows. Nothing that is stored is ever changed, so a number that was read stays true;
but a campaign may be withdrawn, and its name given to another, while somebody computes with the first. What was
computed is then refused (``is_same_campaign``). A block that has to see one moment takes ``reading``.
"""

from __future__ import annotations

import atexit
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import duckdb

from monitor.exceptions import BusyError, StoreError, UnfinishedLogError
from monitor.store import migrations
from monitor.store.connection import Database
from monitor.store.opening import busy, close_written, connect, is_missing
from monitor.store.turns import Patience, turn_to_write, writer_at_work
from monitor.store.unwritable import private_copy, state_of_file, why_not_written

#: How long the file stays open for the next question, in s: to open it takes some 10 ms. Whoever reads keeps it longer
#: while nobody has taken the turn to write: what is computed between two questions of one verb.
_IDLE_READING_S, _IDLE_WRITING_S, _LOOK_S = 0.05, 0.02, 0.01
_IDLE_ALONE_S = 0.3
#: Whoever wrote and was not given the processor since, on a busy machine, is not idle: the second transaction of a verb
#: would wait for another turn. It is once it computed for so long, or after so long by the clock, in s; whoever waits
#: for processes of its own keeps the file as long.
_COMPUTED_S, _IDLE_AT_MOST_S = 0.005, 0.25
#: How long it is kept without a pause, in s; longer only by the one question or transaction that is under way.
_LONGEST_S = 0.5
#: How long a process that ends waits for a question of another thread, in s.
_LAST_QUESTION_S = 10.0

#: The databases of this process that have their file open.
_OPEN: weakref.WeakSet[SharedDatabase] = weakref.WeakSet()


@contextmanager
def one_at_a_time(db: Database, what: str) -> Iterator[None]:
    """Let one process at a time into this block of a database; ``what`` names it. Others may use the database.

    Where the system has no locks of files, or the folder cannot be written, nobody waits. Raises BusyError.
    """
    if db.path == ":memory:":
        yield
        return
    name, patience = f"{db.path}.{what}", db.patience()
    with turn_to_write(name, patience) as holder:
        if holder is not None:
            raise busy(name, holder, patience)
        yield


class SharedDatabase(Database):
    """A database file that others use, too; use it in a ``with`` statement.

    ``patience`` says how long another process is waited for. A file that is not there is made, unless ``read_only``. An
    older schema is brought to the present one where this user may write. ``unstored`` is told once why answers are not
    stored, where they are not (``unwritable``). Raises BusyError, StoreError.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        read_only: bool = False,
        threads: int | None = None,
        actor: str = "",
        patience: Patience | None = None,
        unstored: Callable[[str], None] = lambda why: None,
    ) -> None:
        self._waiting = patience or Patience()
        self._unstored: Callable[[str], None] | None = unstored
        #: Whether a private copy is open in place of the file, and whether it is written now.
        self._is_copy = self._copy_is_written = False
        self._copied_state: tuple[tuple[int, ...], ...] = ()
        self._turn = ExitStack()
        self._writes = False
        self._blocks = 0
        self._opened_at = self._used_at = self._processor_used_s = 0.0
        self._openings = 0
        self._numbers: dict[str, int] = {}
        super().__init__(path, read_only=read_only, threads=threads, actor=actor)

    def close(self) -> None:
        """Let go of the file for good."""
        with self._lock:
            self._let_go()

    def is_same_campaign(self, name: str, number: int) -> bool:
        """Whether a name still is that of the campaign that it was when it was first asked for."""
        return self._numbers.setdefault(name, number) == number

    def forget_campaigns(self) -> None:
        self._numbers.clear()

    def begin_question(self) -> None:
        """As before; and let go of a private copy whose file others have written since.

        Not between two questions: what was identified on the way of one is read from the copy until its end.
        """
        super().begin_question()
        with self._lock:
            if self._is_copy and not self._blocks and state_of_file(self.path) != self._copied_state:
                self._let_go()

    @property
    def keeps_answers(self) -> bool:
        """Whether this user may write the file."""
        return self.read_only or why_not_written(self.path) is None

    def remember(self, document: str) -> int:
        """Remember an answer, and say that it is not stored."""
        self._say_unstored()
        return super().remember(document)

    @contextmanager
    def storing_answer(self) -> Iterator[None]:
        """Store in this block what was computed from the database; of a file that may not be written in a copy."""
        with ExitStack() as block:
            if not self.keeps_answers:
                self._say_unstored()
                block.enter_context(self._in_copy())
            block.enter_context(self.transaction())
            yield

    def _say_unstored(self) -> None:
        say, self._unstored = self._unstored, None
        if say is not None:
            say(f"the answer was not stored: {why_not_written(self.path)}")

    @contextmanager
    def _in_copy(self) -> Iterator[None]:
        """Write in this block a private copy, which stands for the file until it is let go of."""
        with self._one_writes, self._lock:
            if not self._is_copy:
                self._open_copy()
            self._copy_is_written = True
            try:
                yield
            finally:
                self._copy_is_written = False

    def _open_copy(self) -> None:
        with ExitStack() as copied:
            with self._used():
                self._copied_state = state_of_file(self.path)
                path = copied.enter_context(private_copy(self.path))
            self._let_go()
            self._connection = connect(path, False, self._threads)
            self._turn = copied.pop_all()
        self._is_copy = True
        self._openings += 1
        _OPEN.add(self)

    @contextmanager
    def reading(self) -> Iterator[None]:
        """Show the database of one moment in this block: nobody else stores anything meanwhile."""
        with self._kept():
            yield

    @contextmanager
    def _kept(self) -> Iterator[None]:
        with self._used():
            self._blocks += 1
            try:
                yield
            finally:
                self._blocks -= 1

    def patience(self) -> Patience:
        return self._waiting

    def _open(self) -> None:
        with self._used():
            return

    @contextmanager
    def _used(self) -> Iterator[duckdb.DuckDBPyConnection]:
        with self._lock:
            if self._connection is not None and self._is_overdue():
                self._let_go()
            if self._connection is None:
                self._open_to_read()
            with super()._used() as connection:
                yield connection
            self._note_use()

    @contextmanager
    def _writing(self) -> Iterator[duckdb.DuckDBPyConnection]:
        if not self._copy_is_written and (not self._writes or self._is_overdue()):
            self._let_go()
            self._open_to_write()
        # Kept from here on: a process that stood still meanwhile would find itself overdue, and open it to read.
        self._blocks += 1
        try:
            with super()._writing() as connection:
                yield connection
        finally:
            self._blocks -= 1

    def _is_overdue(self) -> bool:
        """Whether the file was kept for long enough and somebody else may want it."""
        if (
            self._is_copy
            or self._blocks
            or self._in_transaction
            or time.monotonic() - self._opened_at < _LONGEST_S
        ):
            return False
        return self._writes or writer_at_work(self.path) is not None

    def _open_to_read(self) -> None:
        if self.path == ":memory:" or (is_missing(self.path) and not self.read_only):
            raise StoreError(f"the database {self.path} is no longer there")
        try:
            connection = connect(self.path, True, self._threads, self._waiting)
        except UnfinishedLogError:
            # A process died, or found the disk full, in a checkpoint: whoever may write finishes it.
            if self.read_only:
                raise
            self._open_to_write()
            return
        try:
            waiting = migrations.pending(connection, self._available)
        except StoreError as fault:
            connection.close()
            raise StoreError(f"{self.path}: {fault}") from fault
        except BaseException:
            connection.close()
            raise
        if waiting:
            connection.close()
            self._bring_up_to_date()
        else:
            self._keep(connection)

    def _bring_up_to_date(self) -> None:
        """Apply the waiting migrations where this user may, as every verb did that met an old database."""
        try:
            if self.read_only:
                raise StoreError("it was opened for reading only")
            self._open_to_write()
        except BusyError:
            raise
        except StoreError as fault:
            raise StoreError(
                f"{self.path} is older than this software and has to be brought to the present schema once, by "
                f"somebody who may write it: `monitor --db {self.path} verify`. Here: {fault}"
            ) from fault

    def _open_to_write(self) -> None:
        with ExitStack() as turn:
            holder = turn.enter_context(turn_to_write(self.path, self._waiting))
            if holder is not None:
                raise busy(self.path, holder, self._waiting)
            connection = connect(self.path, False, self._threads, self._waiting)
            try:
                self._fit(connection)
            except BaseException:
                close_written(connection, self.path)
                raise
            self._turn = turn.pop_all()
        self._writes = True
        self._keep(connection)

    def _keep(self, connection: duckdb.DuckDBPyConnection) -> None:
        self._connection = connection
        self._opened_at = time.monotonic()
        self._note_use()
        self._openings += 1
        _OPEN.add(self)
        threading.Thread(target=self._watch, args=(self._openings,), daemon=True).start()

    def _watch(self, opening: int) -> None:
        """Let go of the file once nothing was asked for a moment.

        It knows the opening by its number: a connection that lost its last reference here, outside of the lock, while
        Python ends, would abort the process.
        """
        while self._is_open_since(opening):
            time.sleep(_LOOK_S)
            if not self._lock.acquire(blocking=False):
                continue
            try:
                if self._is_open_since(opening) and self._is_idle():
                    self._let_go()
            finally:
                self._lock.release()

    def _may_have_written(self) -> bool:
        return self._writes

    def _prepare_commit(self) -> None:
        if not self._is_copy:
            super()._prepare_commit()

    def _note_use(self) -> None:
        self._used_at, self._processor_used_s = time.monotonic(), time.process_time()

    def _is_idle(self) -> bool:
        """Whether nothing was asked for so long that others may have the file."""
        idle_s = time.monotonic() - self._used_at
        if self._writes:
            computed_s = time.process_time() - self._processor_used_s
            return idle_s > (_IDLE_WRITING_S if computed_s > _COMPUTED_S else _IDLE_AT_MOST_S)
        return idle_s > _IDLE_ALONE_S or (idle_s > _IDLE_READING_S and writer_at_work(self.path) is not None)

    def _is_open_since(self, opening: int) -> bool:
        return self._connection is not None and self._openings == opening

    def _let_go(self) -> None:
        super().close()
        self._connection = None
        self._writes = self._is_copy = False
        self._turn.close()
        _OPEN.discard(self)


@atexit.register
def _let_go_of_all() -> None:
    """Let go of what was not closed before Python ends its threads: one in the middle of it would abort the process."""
    for database in tuple(_OPEN):
        if database._lock.acquire(timeout=_LAST_QUESTION_S):
            try:
                database._let_go()
            finally:
                database._lock.release()
