"""Tables as a spreadsheet saves them, workbooks and CSV with semicolons and decimal commas, made plain CSV.

A German Excel writes ``1,5;WAHR``. Cells may have a decimal comma there, because the comma separates nothing. In a
table that has decimal points as well the rarer mark is the slip, and its cells are refused; where both are as frequent,
nobody can know what the commas mean.
"""

from __future__ import annotations

import csv
import io
import re
import warnings
import zipfile
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import date, datetime
from pathlib import Path
from typing import Any

from monitor.exceptions import Fault
from monitor.readers.faults import Faults, quoted
from monitor.readers.files import LARGEST_CSV, decode, read_bytes
from monitor.records import SourceFile

#: Instead of NAME.csv: a workbook of that table, or one workbook with a sheet of its name for every table.
WORKBOOK = "campaign.xlsx"
_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+([eE][+-]?[0-9]+)?")
_POINT = re.compile(r"[+-]?[0-9]*\.[0-9]+([eE][+-]?[0-9]+)?")
_TRUTHS = {"WAHR": "true", "FALSCH": "false", "TRUE": "true", "FALSE": "false"}
#: Unpacked, a workbook of a million rows has some 200 MiB; what is larger is an attack on memory.
UNPACKED_BYTES = 512 * 2**20
#: What zipfile and openpyxl raise for a file that is no workbook, or a damaged one.
_UNREADABLE = (zipfile.BadZipFile, zlib.error, KeyError, ValueError, OSError, SyntaxError)
#: Columns of true and false.
_OF_TRUTHS = ("warm_up",)


def read_table(folder: Path, name: str, faults: Faults) -> tuple[SourceFile | None, str | None]:
    """Return the file that holds the table ``name`` (``runs.csv``) with its text as plain CSV.

    A workbook is read where there is no such file. What cannot be read is noted, and is None; so is a table that stands
    in two files, of which one is older.
    """
    stem = name.removesuffix(".csv")
    sheets = _sheets_of(folder / WORKBOOK)
    if sheets is None and (folder / name).is_file():
        faults.add(
            WORKBOOK, None, None,
            "this is no workbook of Excel (.xlsx) that can be read; take it away, or save it anew and take away the "
            "tables that it holds",
        )  # fmt: skip
    holding = [file for file in (name, f"{stem}.xlsx") if (folder / file).is_file()]
    holding += [WORKBOOK] if sheets is not None and stem in sheets else []
    if len(holding) > 1:
        faults.add(
            name,
            None,
            None,
            f"this table stands in {' and in '.join(holding)}; take away what is not to be read",
        )
        return None, None
    books = [] if (folder / name).exists() else [f"{stem}.xlsx", WORKBOOK]
    book = next((book for book in books if (folder / book).is_file()), None)
    content = read_bytes(folder, book or name, LARGEST_CSV, faults)
    if content is None:
        return None, None
    text = (
        decode(name, content, faults, of_spreadsheet=True)
        if book is None
        else _sheet_text(book, content, stem, faults)
    )
    return SourceFile(book or name, content), text


def _sheets_of(path: Path) -> list[str] | None:
    """The names of the sheets of the workbook of all tables in small letters, none where there is no such file; None
    where it is no workbook."""
    if not path.is_file():
        return []
    try:
        with zipfile.ZipFile(path) as packed, packed.open("xl/workbook.xml") as listed:
            names = re.findall(rb'<sheet\b[^>]*\bname="([^"]*)"', listed.read(2**20))
    except (*_UNREADABLE, NotImplementedError, RuntimeError):
        return None
    return [name.decode("utf-8", "replace").lower() for name in names]


def renamed(faults: Iterable[Fault], files: Mapping[str, str]) -> list[Fault]:
    """Return the faults under the names of the files that their tables were read from, with the sheet of the workbook
    that holds all tables."""
    return [_renamed(fault, files.get(fault.file, fault.file)) for fault in faults]


def _renamed(fault: Fault, file: str) -> Fault:
    sheet = fault.file.removesuffix(".csv") if file == WORKBOOK and fault.file != WORKBOOK else fault.sheet
    return replace(fault, file=file, sheet=sheet)


def plain_csv(file: str, text: str, faults: Faults) -> str:
    """Return a table that is separated by semicolons or tabs as plain CSV with the same lines; any other as it is.

    A decimal point among more decimal commas is noted.
    """
    header = text.partition("\n")[0]
    mark = next((mark for mark in ";\t" if mark in header and "," not in header), None)
    if mark is None:
        return text
    lines = text.split("\n")
    try:
        rows = [next(csv.reader([line.rstrip("\r")], delimiter=mark, strict=True), []) for line in lines]
    except csv.Error:
        return text
    points = sum(_POINT.fullmatch(cell) is not None for row in rows[1:] for cell in row)
    commas = sum(_COMMA.fullmatch(cell) is not None for row in rows[1:] for cell in row)
    if commas > points > 0:
        _note_points(file, rows, faults)
    return _written(_with_points(rows, of_commas=commas > points))


def _note_points(file: str, rows: Sequence[list[str]], faults: Faults) -> None:
    """Note every cell with a decimal point of a table with decimal commas."""
    for line, row in enumerate(rows[1:], start=2):
        for index, cell in enumerate(row):
            if _POINT.fullmatch(cell):
                column = rows[0][index] if index < len(rows[0]) else None
                comma = quoted(cell.replace(".", ","))
                faults.add(
                    file, line, column,
                    f"{quoted(cell)} has a decimal point in a table of decimal commas; write {comma}",
                )  # fmt: skip


def _with_points(rows: Sequence[list[str]], *, of_commas: bool) -> Iterable[list[str]]:
    """Yield the rows with decimal points in place of commas, and with true and false in their column."""
    truths = {index for index, name in enumerate(rows[0]) if name in _OF_TRUTHS}
    yield rows[0]
    for row in rows[1:]:
        yield [
            _TRUTHS.get(cell, cell) if index in truths
            else cell.replace(",", ".") if of_commas and _COMMA.fullmatch(cell)
            else cell
            for index, cell in enumerate(row)
        ]  # fmt: skip


def _written(rows: Iterable[Sequence[str]]) -> str:
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    for row in rows:
        # An empty row stays an empty line, so that all lines keep their numbers.
        if any(row):
            writer.writerow(row)
        else:
            stream.write("\n")
    return stream.getvalue()


def _sheet_text(file: str, content: bytes, stem: str, faults: Faults) -> str | None:
    rows = sheet_rows(file, content, stem, faults, or_first=file != WORKBOOK)
    if rows is None:
        return None
    width = max((index + 1 for index, cell in enumerate(rows[0] if rows else []) if cell), default=0)
    # A row ends with its last cell that was ever filled; what stands beside the table is a fault of its row.
    cut = [
        [*row, *[""] * (width - len(row))][:width] + [cell for cell in row[width:] if cell] for row in rows
    ]
    text = _written(cut).rstrip("\n")
    if not text:
        faults.add(file, None, None, f"the sheet of '{stem}' is empty; its first row names the columns")
        return None
    return text + "\n"


def sheet_rows(
    file: str, content: bytes, sheet: str | None, faults: Faults, *, or_first: bool = False
) -> list[list[str]] | None:
    """Return the cells of a sheet as CSV writes them, of the first sheet where none is named (``or_first``: or none has
    that name); None with the fault noted."""
    try:
        from openpyxl import load_workbook
    except ImportError:
        faults.add(
            file, None, None,
            "workbooks need openpyxl: pip install 'machine-health-monitor[excel]', or save the table as CSV",
        )  # fmt: skip
        return None
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as packed:
            unpacked = sum(member.file_size for member in packed.infolist())
        if unpacked > UNPACKED_BYTES:
            faults.add(
                file, None, None, f"the workbook unpacks to more than {UNPACKED_BYTES // 2**20} MiB; split it"
            )
            return None
        with warnings.catch_warnings():
            # What openpyxl does not keep (drop-down lists, colours) is not read either.
            warnings.simplefilter("ignore")
            book = load_workbook(io.BytesIO(content), read_only=True, data_only=True)
    except _UNREADABLE as error:
        _note_no_workbook(file, error, faults)
        return None
    names = {name.casefold(): name for name in book.sheetnames}
    first = book.sheetnames[0] if book.sheetnames else None
    title = first if sheet is None else names.get(sheet.casefold(), first if or_first else None)
    if title is None:
        listed = ", ".join(book.sheetnames)
        faults.add(
            file,
            None,
            None,
            f"there is no sheet '{sheet}'; name the sheet of that table so; there are {listed}",
        )
        return None
    try:
        return [[_cell(value) for value in row] for row in book[title].iter_rows(values_only=True)]
    except _UNREADABLE as error:  # a damaged sheet of a workbook that is whole elsewhere
        _note_no_workbook(file, error, faults)
        return None


def _note_no_workbook(file: str, error: Exception, faults: Faults) -> None:
    faults.add(file, None, None, f"this is no workbook of Excel (.xlsx) that can be read: {str(error)[:100]}")


def _cell(value: Any) -> str:
    """A cell as CSV writes it: decimal points, true and false, moments in ISO 8601."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    if isinstance(value, datetime | date):
        return value.isoformat()
    return " ".join(str(value).splitlines())
