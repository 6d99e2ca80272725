"""Everything as CSV or Parquet, for other software and for the day when this one is no longer there.

A folder with a file for every table and view, ``columns.csv`` with the meaning and unit of every column, and
the imported files, byte for byte, under ``source_files/NUMBER OF THE CAMPAIGN/``. In CSV the maps and lists
are text, bytes are left out, and text that a spreadsheet would run as a formula begins with an apostrophe; Parquet
has everything as it is. The folder gets its name when it is whole.
"""

from __future__ import annotations

import contextlib
import csv
import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import duckdb

from monitor.exceptions import InputError, NotFoundError, StoreError, did_you_mean
from monitor.formula_cells import FORMULA
from monitor.store.catalogue import check_machine
from monitor.store.connection import Database

#: Ends of names that are those of one file.
_FILES = (".csv", ".parquet", ".xlsx", ".xls", ".json")
_OPTIONS = {"csv": "FORMAT csv, HEADER", "parquet": "FORMAT parquet, COMPRESSION zstd"}


def export_tables(
    db: Database,
    folder: str | Path,
    form: Literal["csv", "parquet"] = "csv",
    *,
    tables: Sequence[str] | None = None,
    machine: str | None = None,
) -> tuple[Path, ...]:
    """Write all tables, views and imported files into a new or empty folder; the files written.

    With ``tables`` those alone; with ``machine`` the rows of one machine of those that name it. Imported files come
    with a whole export only. Raises InputError for another form or a folder that is not empty, NotFoundError for a
    table or machine that is not there, StoreError where it cannot be written.
    """
    if form not in _OPTIONS:
        raise InputError(f"a database is exported as csv or parquet, not {form!r}")
    folder = Path(folder)
    _remove_mark(folder)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder} is not an empty folder; name a new one")
    if folder.suffix.lower() in _FILES:
        raise InputError(
            f"{folder} is the name of one file, and an export is a folder of them: name a folder; one table alone is "
            'written by `monitor sql "FROM v_parameters" --csv > FILE`, or into a workbook, a file ending in .xlsx'
        )
    if machine is not None:
        check_machine(db, machine)
    relations = _chosen(db, tables, machine)
    partial = folder.with_name(folder.name + ".partial")
    try:
        _remove(partial)
        partial.mkdir(parents=True, mode=0o700)
        (partial / _MARK).touch()
        written = [_copy(db, name, partial, form, machine) for name in relations]
        written.append(_columns(db, partial))
        if tables is None and machine is None:
            written += _source_files(db, partial)
        if folder.exists():
            folder.rmdir()  # an empty one; Windows puts no folder in the place of another
        partial.replace(folder)
        # Last: killed before that, the next export would find a folder that it may not remove.
        _remove_mark(folder)
    except (OSError, StoreError, duckdb.IOException) as fault:
        with contextlib.suppress(OSError):
            _remove(partial)
        raise StoreError(f"the export to {folder} could not be written: {fault}") from fault
    return tuple(folder / file.relative_to(partial) for file in written)


def _remove_mark(folder: Path) -> None:
    with contextlib.suppress(OSError):
        (folder / _MARK).unlink(missing_ok=True)


def _remove(partial: Path) -> None:
    """Remove what an export left that was killed; nothing that is not marked as such."""
    if (partial / _MARK).is_file() and not partial.is_symlink():
        shutil.rmtree(partial)


#: In a folder that is not whole yet.
_MARK = ".unfinished-export"


def _names(db: Database) -> list[str]:
    return [
        name
        for (name,) in db.rows(
            "SELECT DISTINCT table_name FROM duckdb_columns() "
            "WHERE database_name = current_database() AND NOT internal ORDER BY table_name"
        )
    ]


def _chosen(db: Database, tables: Sequence[str] | None, machine: str | None) -> list[str]:
    """The tables that are asked for; of one machine without names every view that has a machine."""
    names = _names(db)
    if tables is None and machine is not None:
        return [name for name in names if name.startswith("v_") and _has_machine(db, name)]
    wanted = names if tables is None else tables
    if not wanted:
        raise InputError("no table was named; leave it out for all of them")
    relations = [name if name in names else f"v_{name}" for name in wanted]
    for asked, name in zip(wanted, relations, strict=True):
        if name not in names:
            raise NotFoundError(
                f"there is no table {asked!r}; {did_you_mean(asked, names)}there are {', '.join(names)}"
            )
    return relations


def tables_without_rows(db: Database, tables: Sequence[str], machine: str | None) -> tuple[str, ...]:
    """The tables and views of those that are named which have no row, of a machine where one is named and they have
    one. Raises NotFoundError for a table that is not there."""
    return tuple(
        name
        for name in _chosen(db, tables, machine)
        if not db.rows(f'SELECT 1 FROM "{name}"{_of_machine(db, name, machine)} LIMIT 1')
    )


def _of_machine(db: Database, name: str, machine: str | None) -> str:
    """The condition for the rows of a machine, which COPY cannot bind; empty where there is none."""
    if machine is None or not _has_machine(db, name):
        return ""
    return " WHERE machine = '{}'".format(machine.replace("'", "''"))


def _has_machine(db: Database, name: str) -> bool:
    return bool(
        db.rows(
            "SELECT 1 FROM duckdb_columns() WHERE database_name = current_database() AND table_name = ? "
            "AND column_name = 'machine'",
            [name],
        )
    )


def _copy(db: Database, name: str, folder: Path, form: str, machine: str | None) -> Path:
    path = folder / f"{name}.{form}"
    columns = []
    for column, kind in db.rows(
        "SELECT column_name, data_type FROM duckdb_columns() "
        "WHERE database_name = current_database() AND table_name = ? ORDER BY column_index",
        [name],
    ):
        if form == "csv" and kind == "BLOB":
            continue
        columns.append(_column(column, kind) if form == "csv" else f'"{column}"')
    # The names come from the catalogue; path and machine, which COPY cannot bind, are quoted.
    literal = str(path).replace("'", "''")
    where = _of_machine(db, name, machine)
    db.execute(f"COPY (SELECT {', '.join(columns)} FROM \"{name}\"{where}) TO '{literal}' ({_OPTIONS[form]})")
    return path


def _column(column: str, kind: str) -> str:
    """A column as CSV has it: maps as JSON, and no text that a spreadsheet takes for a formula."""
    if "MAP" in kind:
        return f'to_json("{column}") AS "{column}"'
    if kind == "VARCHAR":
        quote = "''''"  # one apostrophe, as SQL writes it
        is_formula = f"regexp_matches(\"{column}\", '{FORMULA}')"
        return f'CASE WHEN {is_formula} THEN {quote} || "{column}" ELSE "{column}" END AS "{column}"'
    return f'"{column}"'


def _columns(db: Database, folder: Path) -> Path:
    path = folder / "columns.csv"
    rows = db.rows(
        "SELECT table_name, column_name, data_type, comment FROM duckdb_columns() "
        "WHERE database_name = current_database() AND NOT internal ORDER BY table_name, column_index"
    )
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator=os.linesep)
        writer.writerows([("table_name", "column_name", "data_type", "comment"), *rows])
    return path


def _source_files(db: Database, folder: Path) -> list[Path]:
    written = []
    for campaign_id, file, content in db.rows(
        "SELECT campaign_id, file, content FROM source_file "
        # Of those that were archived there is only the hash.
        "WHERE octet_length(content) > 0 OR sha256 = sha256('') ORDER BY ALL"
    ):
        # Only the last part of a stored name: nothing is written outside the folder.
        path = folder / "source_files" / str(campaign_id) / Path(file).name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        written.append(path)
    return written
