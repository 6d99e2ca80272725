"""Reads a lake as one database of a plant is read: the same tables, columns and views, the same queries.

A lake is read at the moment at which it was opened: what plants publish meanwhile is not seen. Nothing is written: what
a verb would keep (the answer of ``trend``) is not kept.
"""

from __future__ import annotations

import copy
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import duckdb

from monitor.exceptions import StoreError
from monitor.store.connection import Database
from monitor.store.lake.attaching import LAKE, attach, check_lake_address, connection_with_extensions
from monitor.store.lake.schema import check_schema, has_schema


class LakeDatabase(Database):
    """All plants that publish to a lake as one database, for reading; use it in a ``with`` statement.

    ``path`` is the address. Raises InputError for what is none, or without the extra; StoreError for a lake that
    cannot be opened, holds nothing, or has another schema than this software.
    """

    is_lake = True

    @property
    def keeps_answers(self) -> bool:
        """Nothing is written to a lake but by publication."""
        return False

    def __init__(self, address: str, *, threads: int | None = None, actor: str = "") -> None:
        super().__init__(address, read_only=True, threads=threads, actor=actor)

    def _check_name(self) -> None:
        check_lake_address(self.path)

    def _open(self) -> None:
        connection = connection_with_extensions(self._threads)
        self._connection = connection
        try:
            attach(connection, self.path, "READ_ONLY")
            if not has_schema(connection):
                raise StoreError(
                    f"{self.path} is a lake of something else, or nothing was published to it yet"
                )
            check_schema(connection, self.path)
            row = connection.execute(f"SELECT id FROM ducklake_current_snapshot('{LAKE}')").fetchone()
            assert row is not None
            connection.execute(f"DETACH {LAKE}")
            attach(connection, self.path, "READ_ONLY", f"SNAPSHOT_VERSION {int(row[0])}")
            connection.execute(f"USE {LAKE}")
        except BaseException as fault:
            self.close()
            if isinstance(fault, duckdb.Error):
                raise StoreError(
                    f"the lake {self.path} cannot be read: {' '.join(str(fault).split())}"
                ) from fault
            raise

    def session(self, actor: str) -> Database:
        session = copy.copy(self)
        session.actor = actor
        session._lock = threading.RLock()
        with self._used() as connection:
            session._connection = connection.cursor()
            session._connection.execute(f"USE {LAKE}")
        return session

    @contextmanager
    def reading(self) -> Iterator[None]:
        """Show the lake of the moment at which it was opened, as every question does."""
        with self._lock:
            yield

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Raise StoreError: nothing is written to a lake but by publication."""
        raise StoreError(
            f"{self.path} is a lake, which plants publish to and everybody reads: store it in the database of the "
            "plant (--db FILE) and publish that"
        )
        yield  # type: ignore[unreachable]
