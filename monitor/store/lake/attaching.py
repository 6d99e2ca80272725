"""Opens a lake: the extensions of DuckDB, the address, the retries.

An address is ``ducklake:postgres:dbname=lake host=...`` (catalogue in PostgreSQL, for many plants at once) or
``ducklake:FILE`` (catalogue in a DuckDB file, for one process at a time). The catalogue holds where the Parquet files
lie, in a folder or an object store. Passwords do not belong into an address, which everybody sees in the list of
processes: PostgreSQL's own client library reads ``~/.pgpass`` and ``$PGPASSWORD``.
"""

from __future__ import annotations

import os
import re

import duckdb

from monitor.exceptions import InputError, StoreError
from monitor.store.kept_blocks import has_torn_blocks, settle_blocks
from monitor.store.lake.extensions import literal, load
from monitor.store.lake.object_store import enter
from monitor.store.opening import show_no_progress

#: Under which name a lake is attached.
LAKE = "lake"
_SCHEME = "ducklake:"
#: What stands before the name of a catalogue that is no DuckDB file.
_SERVERS = ("postgres:", "postgresql:", "mysql:", "sqlite:")
_EXTENSIONS = ("ducklake", "postgres_scanner")
#: What DuckDB says where the files of a lake lie in an object store.
_NOT_ENTERED = "requires the extension httpfs"


def is_lake(address: str) -> bool:
    """Whether a database is named by the address of a lake."""
    return address.startswith(_SCHEME)


def check_lake_address(address: str) -> None:
    """Raise InputError for what is no address of a lake, or holds a password."""
    if not is_lake(address) or not address.removeprefix(_SCHEME).strip():
        raise InputError(
            f"{address} is no address of a lake; write 'ducklake:postgres:dbname=lake host=db.example.org', or "
            "ducklake:FILE for a lake of one process at a time"
        )
    if re.search(r"password\s*=|://[^/@\s]*:[^/@\s]*@", address, re.IGNORECASE):
        raise InputError(
            "the address of a lake holds a password, which the list of processes shows to everybody; put it into "
            "~/.pgpass or $PGPASSWORD, which PostgreSQL's client reads"
        )


def catalogue_file(address: str) -> str | None:
    """Return the DuckDB file that is the catalogue of a lake; None for one in another program's database."""
    name = address.removeprefix(_SCHEME)
    return None if name.startswith(_SERVERS) else name.removeprefix("duckdb:")


def connection_with_extensions(threads: int | None = None) -> duckdb.DuckDBPyConnection:
    """Return a connection in memory that can attach lakes. Raises InputError where the extra is not installed."""
    config: dict[str, str | bool | int | float | list[str]] = {
        "autoinstall_known_extensions": "false",
        "autoload_known_extensions": "false",
    }
    if threads is not None:
        config["threads"] = str(threads)
    connection = duckdb.connect(":memory:", config=config)
    show_no_progress(connection)
    for name in _EXTENSIONS:
        load(connection, name)
    return connection


def refuse_other_database(connection: duckdb.DuckDBPyConnection, address: str) -> None:
    """Raise InputError where a new lake would be made inside a database of something else, as that of a plant."""
    catalogue = catalogue_file(address)
    if catalogue is None or not os.path.isfile(catalogue) or os.stat(catalogue).st_size == 0:
        return
    try:
        connection.execute(f"ATTACH {literal(catalogue)} AS before (READ_ONLY)")
    except duckdb.Error:
        return  # attaching it as a lake says why not
    tables = connection.execute(
        "SELECT table_name FROM duckdb_tables() WHERE database_name = 'before'"
    ).fetchall()
    connection.execute("DETACH before")
    if tables and ("ducklake_metadata",) not in tables:
        raise InputError(
            f"{catalogue} is a database of something else: the catalogue of a lake has a file of its own, such as "
            "ducklake:lake.ducklake"
        )


def attach(connection: duckdb.DuckDBPyConnection, address: str, *options: str) -> None:
    """Attach a lake under its name. Raises StoreError for one that cannot be opened or is not there.

    What half a write damaged in a catalogue of DuckDB is put back first (``kept_blocks``).
    """
    check_lake_address(address)
    catalogue = catalogue_file(address)
    if catalogue is not None:
        settle_blocks(catalogue)
        if has_torn_blocks(catalogue):
            raise StoreError(
                f"{catalogue} holds half a block of a write that was cut off; what was there before lies beside it, "
                "and is put back by whoever opens the lake next and may write the file"
            )
    bracketed = f" ({', '.join(options)})" if options else ""
    statement = f"ATTACH {literal(address)} AS {LAKE}{bracketed}"
    try:
        try:
            connection.execute(statement)
        except duckdb.Error as fault:
            if _NOT_ENTERED not in str(fault):
                raise
            enter(connection)
            connection.execute(statement)
    except duckdb.Error as fault:
        raise StoreError(_in_words(address, str(fault))) from fault


def _in_words(address: str, message: str) -> str:
    if "does not exist" in message and "FATAL" not in message:
        return f"there is no lake at {address}; `monitor publish --to {address!r} --files FOLDER` makes one"
    return f"the lake {address} cannot be opened: {' '.join(message.split())}"
