"""Publishes what a plant stored since it last published: append-only, nothing twice, resumed after any break.

The audit of a plant names everything that it ever stored, in order. A publication is the next entries of it with all
rows that they record, in one transaction: what was published is known by the last entry, and its hash shows that the
plant is still the same. A campaign is so published whole or not at all. A transaction that another one was in the way
of, or that the network lost, is begun anew with growing pauses; what is there by then is not added again.
"""

from __future__ import annotations

import contextlib
import random
import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, TypeVar

import duckdb

from monitor import __version__
from monitor.exceptions import InputError, StoreError
from monitor.store.connection import Database, utc_now
from monitor.store.entries import select_portion
from monitor.store.kept_blocks import keep_blocks, settle_blocks
from monitor.store.lake.attaching import (
    LAKE,
    attach,
    catalogue_file,
    connection_with_extensions,
    is_lake,
    refuse_other_database,
)
from monitor.store.lake.copying import attach_origin, statements
from monitor.store.lake.extensions import literal
from monitor.store.lake.names import (
    register_names,
    register_plant,
    registered_plant,
    turn_of,
    unregistered_names,
)
from monitor.store.lake.object_store import address_of_files
from monitor.store.lake.schema import LARGEST_OWN, check_schema, has_schema, make_schema
from monitor.store.turns import Patience

Result = TypeVar("Result")

#: Entries of an audit that are published in one transaction.
PORTION = 200
#: DuckLake 1.5.5 keeps a few rows in the catalogue instead of a Parquet file, lists and maps of doubles as text that is
#: not exact (the 17th digit); a test looks whether it still does.
_NOTHING_INLINED = "DATA_INLINING_ROW_LIMIT 0"
#: How often a transaction is begun, and the first and longest pause in between, in s.
_TRIES, _FIRST_PAUSE_S, _LONGEST_PAUSE_S = 40, 0.1, 5.0
#: What is said of faults that may pass, and of those among them that stay: of a bucket, of PostgreSQL 15 and its client
#: (who asks, with what password, for which database, by what address and options), of rights and room.
_PASSING = (
    *("conflict", "connection", "connect to", "failed to commit", "could not set lock", "deadlock"),
    "query_wait_timeout",
)
_LASTING = re.compile(
    r"nosuchbucket|accessdenied|\bhttp\b.*\b40[134]\b|\b40[134] \("
    r"|authentication failed|no password supplied|no pg_hba\.conf entry|fatal: [^:]* does not exist"
    r"|name or service not known|invalid (connection option|integer value|port number)"
    r"|does not support ssl|certificate verify failed|root certificate file"
    r"|permission denied|must be owner|read-only file system|no space left"
)
#: What a standby server says until it is promoted, which takes seconds, and one that is only read, which stays: it is
#: tried so often, for 7 to 21 s (the pauses are drawn). So is a server that answers whoever connects in words that are
#: not known here, those of another language: a wrong password and a start that is not over are not told apart there.
_STANDBY, _TRIES_OF_UNSURE = "read-only transaction", 13
#: What PostgreSQL and PgBouncer say of themselves while they are busy or a server behind them is away is known.
_ANSWER = re.compile(
    r"failed: \w+:\s(?!.*(starting up|shutting down|recovery|not (yet )?accepting|too many|slots|terminating"
    r"|due to timeout|query_wait_timeout|login_timeout|login has been failing|no more connections|cannot connect))"
)
#: How DuckLake names the statement that its catalogue refused.
_QUERY = re.compile(r'Failed to execute query ".*": (?=ERROR)', re.DOTALL)
#: After how many seconds of trying somebody who waits is told.
_SAID_S = 3.0


@dataclass(frozen=True)
class Published:
    """What a publication did: the plant's name in the lake, how many entries and rows were added, and how often it was
    begun anew; ``last_entry`` is the last entry of the plant's audit that the lake holds."""

    plant: str
    entries: int
    rows: int
    last_entry: int
    last_sha256: str
    tries: int


@dataclass(frozen=True)
class _Portion:
    """Entries of an audit from ``first`` to ``last``, of which ``end`` is the last that is there, with its hash.

    ``rows`` were added; None where another process did, or where nothing is new (``first`` is beyond ``end``).
    """

    first: int
    last: int
    end: int
    sha256: str
    rows: int | None


def publish(
    db: Database,
    address: str,
    *,
    files: str | Path | None = None,
    plant: str | None = None,
    progress: Callable[[int, int], None] = lambda last, end: None,
    away: Callable[[str], None] = lambda fault: None,
) -> Published:
    """Publish everything that a database stored since it last published; ``files`` is the folder or the
    address in an object store (``s3://bucket/folder``) of a new lake.

    ``plant`` names the database at its first publication (default: the name of its file), and no other name later;
    ``progress`` is called with the last entry that was published and the last that is there, ``away`` with the fault
    for which a transaction is tried again for long. The database is closed. Raises StoreError, InputError.
    """
    if db.path == ":memory:" or is_lake(db.path):
        raise StoreError(f"{db.path} is no database file of a plant; name one with --db")
    # Finishes a log that a killed process left, and brings an old schema to the present one.
    db.rows("SELECT max(entry) FROM audit")
    # DuckDB's lock belongs to the process: a second opening of the file would end that of the first.
    db.close()
    with contextlib.closing(_Publisher(db.path, db.patience(), address, files, away)) as publisher:
        return publisher.publish(plant, progress)


class _Publisher:
    """A connection that has the lake, and the file of the plant for as long as it is read: not while the lake is away,
    so that the plant's own work goes on."""

    def __init__(
        self,
        path: str,
        patience: Patience,
        address: str,
        files: str | Path | None,
        away: Callable[[str], None],
    ) -> None:
        self._path, self._patience, self._address, self._files = path, patience, address, files
        self._away = away
        self._catalogue = catalogue_file(address)
        self._connection = connection_with_extensions()
        self._attached = False
        self._tries = 0
        # First and last entry and rows of what was committed last, and its moment, until the answer comes.
        self._sent: tuple[int, int, int, datetime] | None = None

    def close(self) -> None:
        self._connection.close()
        self._settle()

    def publish(self, wanted: str | None, progress: Callable[[int, int], None]) -> Published:
        """Publish portion by portion; the file is let go in between, so that those who write get their turn."""
        self._again(self._make)
        plant_no, name = self._again(lambda: self._registered(wanted))
        entries = rows = 0
        while True:
            portion = self._again(lambda: self._publish_portion(plant_no, name))
            if portion.first > portion.end:
                return Published(name, entries, rows, portion.end, portion.sha256, self._tries)
            if portion.rows is not None:
                entries, rows = entries + portion.last - portion.first + 1, rows + portion.rows
            progress(portion.last, portion.end)

    def _again(self, attempt: Callable[[], Result]) -> Result:
        """Return what an attempt returns, made anew with growing pauses where the lake refused or was away."""
        pause, begin, is_said = _FIRST_PAUSE_S, time.monotonic(), False
        for remaining in reversed(range(_TRIES)):
            self._tries += 1
            try:
                if not self._attached:
                    self._attach()
                return attempt()
            except (duckdb.Error, StoreError) as fault:
                self._roll_back()
                if not remaining or not _may_pass(str(fault), _TRIES - remaining):
                    if isinstance(fault, StoreError):
                        raise
                    raise StoreError(
                        f"nothing more could be published to {self._address}: {_without_queries(fault)}; what was "
                        "published stays, and the next `monitor publish` goes on behind it"
                    ) from fault
                if not is_said and time.monotonic() - begin > _SAID_S:
                    is_said = True
                    self._away(_without_queries(fault))
            # No randomness of a result: only when two processes try again.
            time.sleep(random.uniform(pause / 3, pause))
            pause = min(1.5 * pause, _LONGEST_PAUSE_S)
        raise AssertionError("the last try returns or raises")

    def _roll_back(self) -> None:
        """Forget the transaction and the lake's connection, which may be the one that is broken."""
        for statement in ("ROLLBACK", "USE memory", f"DETACH {LAKE}"):
            with contextlib.suppress(duckdb.Error):
                self._connection.execute(statement)
        self._attached = False
        self._settle()

    def _settle(self) -> None:
        """Remove the copy of the blocks of a catalogue whose checkpoint is through."""
        if self._catalogue is not None:
            with contextlib.suppress(StoreError):
                settle_blocks(self._catalogue)

    def _keep(self) -> None:
        """Copy the blocks of a catalogue in a DuckDB file that the next checkpoint may write over."""
        if self._catalogue is not None:
            keep_blocks(self._catalogue)

    def _attach(self) -> None:
        options = ["CREATE_IF_NOT_EXISTS false"]
        if self._files is not None:
            refuse_other_database(self._connection, self._address)
            options = [f"DATA_PATH {literal(address_of_files(str(self._files)))}", "OVERRIDE_DATA_PATH false"]
        attach(self._connection, self._address, *options, _NOTHING_INLINED)
        self._attached = True
        # What its log still holds of a process that died is written into the file without a commit of ours.
        self._keep()

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        self._connection.begin()
        yield
        self._commit()

    def _commit(self) -> None:
        self._keep()
        self._connection.commit()

    def _make(self) -> None:
        """Make the tables of a new lake; refuse one of another schema."""
        if not has_schema(self._connection):
            with self._transaction():
                make_schema(self._connection)
        check_schema(self._connection, self._address)

    @contextmanager
    def _origin(self) -> Iterator[None]:
        """Have the plant's file for this block, as those have it who read."""
        attach_origin(self._connection, self._path, self._patience)
        try:
            yield
        finally:
            with contextlib.suppress(duckdb.Error):
                self._connection.execute("ROLLBACK")
            self._connection.execute("DETACH origin")

    def _rows(self, sql: str, *parameters: object) -> list[tuple[Any, ...]]:
        return self._connection.execute(sql, parameters).fetchall()

    def _registered(self, wanted: str | None) -> tuple[int, str]:
        """Return number and name of the plant, registered where it never published.

        Raises InputError where it did under another name than the one that is wanted.
        """
        with self._origin():
            first = self._rows("SELECT entry_sha256 FROM origin.audit WHERE entry = 1")
        if not first:
            raise StoreError(f"{self._path} holds nothing that could be published")
        registered = registered_plant(self._connection, first[0][0])
        if registered is not None:
            if wanted not in (None, registered[1]):
                raise InputError(
                    f"the lake knows {self._path} as plant '{registered[1]}' since it first published, and its names "
                    f"stand there: leave --plant '{wanted}' out. Another plant has a database of its own, not a copy"
                )
            return registered
        name = wanted or Path(self._path).stem
        with self._transaction():
            return register_plant(self._connection, name, first[0][0]), name

    def _publish_portion(self, plant_no: int, name: str) -> _Portion:
        """Add the next entries with all that they record. Raises StoreError for a plant of another past."""
        with self._origin():
            ((end, sha256),) = self._rows("SELECT max(entry), max_by(entry_sha256, entry) FROM origin.audit")
            published = self._last_published(plant_no)
            first = 1 if published is None else published[0] + 1
            if published is not None:
                self._check_past(*published)
            if (arrived := self._arrived(plant_no)) is not None:
                return _Portion(*arrived[:2], end, sha256, arrived[2])
            last = min(first + PORTION - 1, end)
            rows = None
            if first <= end:
                select_portion(self._connection, "origin", first, last)
                ((largest,),) = self._rows("SELECT max(number) FROM portion")
                if largest > LARGEST_OWN:
                    raise StoreError(f"a lake takes numbers of a plant up to {LARGEST_OWN}, not {largest}")
                self._register_names(plant_no, name)
                rows = self._insert(plant_no, first, last)
            return _Portion(first, last, end, sha256, rows)

    def _arrived(self, plant_no: int) -> tuple[int, int, int] | None:
        """Return first and last entry and rows of what the lake took although its answer was lost; None: nothing."""
        if self._sent is None:
            return None
        first, last, rows, moment = self._sent
        sql = f"SELECT 1 FROM {LAKE}.publication WHERE plant_no = ? AND last_entry = ? AND published_at = ?"
        is_there = bool(self._rows(sql, plant_no, last, moment))
        self._sent = None
        return (first, last, rows) if is_there else None

    def _check_past(self, entry: int, expected: str) -> None:
        """Raise StoreError where the entry that the lake holds last has another hash in the plant's audit."""
        if self._rows("SELECT entry_sha256 FROM origin.audit WHERE entry = ?", entry) != [(expected,)]:
            raise StoreError(
                f"{self._path} has another past than it published: entry {entry} of its audit, the last that the lake "
                "holds, is missing or has another hash. The file was put back to an earlier state, or rewritten: "
                "publish the newer file, or make a new lake from the plants"
            )

    def _last_published(self, plant_no: int) -> tuple[int, str] | None:
        """Return number and hash of the last entry that the lake holds of a plant."""
        rows = self._rows(
            f"SELECT last_entry, last_sha256 FROM {LAKE}.publication WHERE plant_no = ? ORDER BY 1 DESC LIMIT 1",
            plant_no,
        )
        return rows[0] if rows else None

    def _register_names(self, plant_no: int, name: str) -> None:
        if unregistered_names(self._connection, plant_no):
            with self._transaction():
                register_names(self._connection, plant_no, name)

    def _insert(self, plant_no: int, first: int, last: int) -> int | None:
        names = self._rows(
            f"SELECT kind, name, shown FROM {LAKE}.plant_name WHERE plant_no = ? AND name <> shown", plant_no
        )
        self._connection.execute(
            "CREATE OR REPLACE TEMP TABLE renamed (kind VARCHAR, name VARCHAR, shown VARCHAR)"
        )
        if names:
            self._connection.executemany("INSERT INTO renamed VALUES (?, ?, ?)", names)
        self._connection.begin()
        self._connection.execute(f"UPDATE {LAKE}.{turn_of(plant_no)} SET publications = publications + 1")
        published = self._last_published(plant_no)
        if (0 if published is None else published[0]) != first - 1:
            self._connection.rollback()
            return None
        ((sha256,),) = self._rows("SELECT entry_sha256 FROM origin.audit WHERE entry = ?", last)
        copied = sum(
            self._rows(statement)[0][0]
            for statement in statements(self._connection, plant_no, {kind for kind, _, _ in names})
        )
        moment = utc_now()
        self._connection.execute(
            f"INSERT INTO {LAKE}.publication VALUES (?, ?, ?, ?, ?, ?, ?)",
            [plant_no, first, last, sha256, copied, __version__, moment],
        )
        self._sent = first, last, int(copied), moment
        self._commit()
        self._sent = None
        return int(copied)


def _may_pass(message: str, tries: int) -> bool:
    """Whether a fault may be gone with the next try, after so many ``tries``: a conflict with another writer, or a lake
    that was away.

    Whom a server does not let in, or what it does not have, stays so. DuckDB gives the words of a server without its
    SQLSTATE.
    """
    said = message.lower()
    if _LASTING.search(said) is not None:
        return False
    if _STANDBY in said or _ANSWER.search(said) is not None:
        return tries < _TRIES_OF_UNSURE
    return any(phrase in said for phrase in _PASSING)


def _without_queries(fault: Exception) -> str:
    """Return what a fault says without the statement of DuckLake, which may have pages, and in one line."""
    return " ".join(_QUERY.sub("", str(fault)).split())
