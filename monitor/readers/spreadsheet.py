"""Tables as a spreadsheet saves them, workbooks and CSV with semicolons and decimal commas, made plain CSV.

A German Excel writes ``1,5;WAHR``. Cells may have a decimal comma there, because the comma separates nothing; a table
that has decimal points as well is left as it is, since then nobody can know what its commas mean.
"""

from __future__ import annotations

import csv
import io
import re
import warnings
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import date, datetime
from pathlib import Path
from typing import Any

from monitor.exceptions import Fault
from monitor.readers.faults import Faults
from monitor.readers.files import LARGEST_CSV, decode, read_bytes
from monitor.records import SourceFile

#: Instead of NAME.csv: a workbook of that table, or one workbook with a sheet of its name for every table.
WORKBOOK = "campaign.xlsx"
_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+([eE][+-]?[0-9]+)?")
_POINT = re.compile(r"[+-]?[0-9]*\.[0-9]+([eE][+-]?[0-9]+)?")
_TRUTHS = {"WAHR": "true", "FALSCH": "false", "TRUE": "true", "FALSE": "false"}
#: Unpacked, a workbook of a million rows has some 200 MiB; what is larger is an attack on memory.
UNPACKED_BYTES = 512 * 2**20
#: Columns of true and false.
_OF_TRUTHS = ("warm_up",)


def read_table(folder: Path, name: str, faults: Faults) -> tuple[SourceFile | None, str | None]:
    """Return the file that holds the table ``name`` (``runs.csv``) with its text as plain CSV.

    A workbook is read where there is no such file. What cannot be read is noted, and is None; so is a table that stands
    in two files, of which one is older.
    """
    stem = name.removesuffix(".csv")
    holding = [file for file in (name, f"{stem}.xlsx", WORKBOOK) if _may_hold(folder / file, stem)]
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


def _may_hold(path: Path, stem: str) -> bool:
    """Whether a file is there that holds a table: the workbook of all tables only where a sheet has its name."""
    if path.name != WORKBOOK:
        return path.is_file()
    try:
        with zipfile.ZipFile(path) as packed, packed.open("xl/workbook.xml") as listed:
            sheets = re.findall(rb'<sheet\b[^>]*\bname="([^"]*)"', listed.read(2**20))
    except (zipfile.BadZipFile, KeyError, ValueError, OSError, NotImplementedError, RuntimeError):
        return False  # said where a table is read from it
    return stem.encode() in [sheet.lower() for sheet in sheets]


def renamed(faults: Iterable[Fault], files: Mapping[str, str]) -> list[Fault]:
    """Return the faults under the names of the files that their tables were read from, with the sheet of the workbook
    that holds all tables."""
    return [_renamed(fault, files.get(fault.file, fault.file)) for fault in faults]


def _renamed(fault: Fault, file: str) -> Fault:
    sheet = fault.file.removesuffix(".csv") if file == WORKBOOK and fault.file != WORKBOOK else fault.sheet
    return replace(fault, file=file, sheet=sheet)


def plain_csv(text: str) -> str:
    """Return a table that is separated by semicolons or tabs as plain CSV with the same lines; any other as it is."""
    header = text.partition("\n")[0]
    mark = next((mark for mark in ";\t" if mark in header and "," not in header), None)
    if mark is None:
        return text
    lines = text.split("\n")
    try:
        rows = [next(csv.reader([line.rstrip("\r")], delimiter=mark, strict=True), []) for line in lines]
    except csv.Error:
        return text
    return _written(_with_points(rows))


def _with_points(rows: Sequence[list[str]]) -> Iterable[list[str]]:
    """Yield the rows with decimal points, where no cell has one, and with true and false in their column."""
    body = rows[1:]
    commas = not any(_POINT.fullmatch(cell) for row in body for cell in row)
    truths = {index for index, name in enumerate(rows[0]) if name in _OF_TRUTHS}
    yield rows[0]
    for row in body:
        yield [
            _TRUTHS.get(cell, cell) if index in truths
            else cell.replace(",", ".") if commas and _COMMA.fullmatch(cell)
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
    except (zipfile.BadZipFile, KeyError, ValueError, OSError, SyntaxError) as error:
        faults.add(
            file, None, None, f"this is no workbook of Excel (.xlsx) that can be read: {str(error)[:100]}"
        )
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
    return [[_cell(value) for value in row] for row in book[title].iter_rows(values_only=True)]


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
