"""Names that DuckDB takes for something else than a database file of its own: refused before anything is opened.

``duckdb.connect`` answers an existing CSV, JSON or Parquet file with an empty database in memory, which is forgotten
when it is closed; a name with a scheme (``md:``, ``sqlite:``, ``duckdb:``) with a service, another program's file, or
another path.
"""

from __future__ import annotations

import re
from pathlib import Path

from monitor.exceptions import StoreError

IN_MEMORY = ":memory:"
#: Where a file of DuckDB says that it is one, and what stands there (DuckDB, storage format: the main header).
_MAGIC_AT, _MAGIC = 8, b"DUCK"
#: The first bytes of an SQLite 3 file (SQLite, database file format, 1.3.1).
_SQLITE = b"SQLite format 3\x00"
#: Ends of names of data files; compressed ones end in a second suffix.
_DATA_SUFFIXES = frozenset(
    ("arrow", "avro", "csv", "feather", "geojson", "ipc", "json", "jsonl", "ndjson", "ods", "orc", "parquet", "shp",
     "sqlite", "sqlite3", "tsv", "xls", "xlsm", "xlsx")
)  # fmt: skip
_COMPRESSED = frozenset(("gz", "zst", "zip", "bz2", "xz"))
# One letter before the colon is a drive of Windows.
_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]+):")


def check_database_name(path: str) -> None:
    """Raise StoreError for a name that is not that of a database file, with one that would be.

    A file that is a database of DuckDB is one whatever its name ends in.
    """
    if path.startswith(IN_MEMORY):
        return
    scheme = _SCHEME.match(path)
    if scheme:
        raise StoreError(
            f"{path} begins with '{scheme[1]}:', which names a service or another program's data, not a database file "
            f"on this machine; {_example(path[scheme.end() :])}"
        )
    start = _first_bytes(path)
    if start.startswith(_SQLITE):
        raise StoreError(
            f"{path} is a database of SQLite, which this software does not read; {_example(path)}"
        )
    suffix = _data_suffix(path)
    if suffix and start[_MAGIC_AT:].startswith(_MAGIC):
        return
    if suffix:
        raise StoreError(
            f"{path} ends in .{suffix}, the name of a data file and not of a database; {_example(path)}"
        )


def _first_bytes(path: str) -> bytes:
    """The first bytes of a file; none of a pipe or device, which would be waited for."""
    try:
        # Opening a pipe waits for somebody who writes; it is refused where the database is opened.
        if not Path(path).is_file():
            return b""
        with Path(path).open("rb") as stream:
            return stream.read(len(_SQLITE))
    except (OSError, ValueError):
        # What cannot be opened is said by DuckDB, in its own case.
        return b""


def _data_suffix(path: str) -> str | None:
    endings = [ending.casefold() for ending in Path(path).name.split(".")[1:]]
    if endings and endings[-1] in _COMPRESSED:
        return ".".join(endings[-2:])
    return endings[-1] if endings and endings[-1] in _DATA_SUFFIXES else None


def _example(path: str) -> str:
    stem = re.split(r"[?#]", Path(path).name)[0].split(".")[0] or "monitor"
    return f"name a file such as {stem}.duckdb"
