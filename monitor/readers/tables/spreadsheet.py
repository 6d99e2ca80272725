"""Tables as a spreadsheet saves them, workbooks and CSV with semicolons and decimal commas, made plain CSV.

A German Excel writes ``1,5;WAHR``. Cells may have a decimal comma there, because the comma separates nothing. In a
table that has decimal points as well the rarer mark is the slip, and its cells are refused; where both are as frequent,
nobody can know what the commas mean.
"""

from __future__ import annotations

import csv
import io
import re
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from monitor.exceptions import Fault
from monitor.readers.faults import Faults, quoted
from monitor.readers.files import LARGEST_CSV, decode, read_bytes
from monitor.readers.tables.workbook import UNREADABLE, listed, read_sheet
from monitor.records import SourceFile

#: Instead of NAME.csv: a workbook of that table, or one workbook with a sheet of its name for every table.
WORKBOOK = "campaign.xlsx"
_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+([eE][+-]?[0-9]+)?")
_POINT = re.compile(r"[+-]?[0-9]*\.[0-9]+([eE][+-]?[0-9]+)?")
_TRUTHS = {"WAHR": "true", "FALSCH": "false", "TRUE": "true", "FALSE": "false"}
#: Workbooks that are tables of a campaign, and files of spreadsheets in general.
_TABLE_BOOK = re.compile(r"(campaign|runs|probings|data)\.xlsx")
_OF_SPREADSHEETS = (".xlsx", ".xlsm", ".xls", ".xlsb", ".ods")
#: Columns of true and false.
_OF_TRUTHS = ("warm_up",)


@dataclass(frozen=True)
class TableText:
    """A table as plain CSV with the file that it was read from; ``sheet`` is that of a workbook with several. Without a
    file or text what is wrong is noted."""

    source: SourceFile | None = None
    text: str | None = None
    sheet: str | None = None

    @property
    def of_workbook(self) -> bool:
        """Whether a spreadsheet holds it as cells and not as text."""
        return self.source is not None and self.source.name.endswith(".xlsx")


def read_table(folder: Path, name: str, faults: Faults) -> TableText:
    """Return the table ``name`` (``runs.csv``) of a folder.

    A workbook is read where there is no such file. What cannot be read is noted; so is a table that stands in two
    files, of which one is older.
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
        return TableText()
    books = [] if (folder / name).exists() else [f"{stem}.xlsx", WORKBOOK]
    book = next((book for book in books if (folder / book).is_file()), None)
    if not holding and book is None and _note_other_workbooks(folder, faults):
        return TableText()
    content = read_bytes(folder, book or name, LARGEST_CSV, faults)
    if content is None:
        return TableText()
    if book is None:
        return TableText(SourceFile(name, content), decode(name, content, faults, of_spreadsheet=True))
    text, sheet = _sheet_text(book, content, stem, faults)
    return TableText(SourceFile(book, content), text, sheet)


def _note_other_workbooks(folder: Path, faults: Faults) -> bool:
    """Note the files of a spreadsheet under names or of kinds that are not read; return whether there are any."""
    with suppress(OSError):
        names = sorted(path.name for path in folder.iterdir() if path.suffix.casefold() in _OF_SPREADSHEETS)
        others = [
            name for name in names if not name.startswith(("~", ".")) and not _TABLE_BOOK.fullmatch(name)
        ]
        for name in others:
            todo = (
                "rename it"
                if name.casefold().endswith(".xlsx")
                else "save it in Excel as .xlsx under such a name"
            )
            faults.add(
                name, None, None,
                f"a workbook with a sheet for every table is called {WORKBOOK}, one with a single table as that is "
                f"(runs.xlsx, probings.xlsx, data.xlsx), in small letters; {todo}",
            )  # fmt: skip
        return bool(others)
    return False


def _sheets_of(path: Path) -> list[str] | None:
    """The names of the sheets of the workbook of all tables in small letters, none where there is no such file; None
    where it is no workbook."""
    if not path.is_file():
        return []
    try:
        with zipfile.ZipFile(path) as packed, packed.open("xl/workbook.xml") as part:
            names = re.findall(rb'<sheet\b[^>]*\bname="([^"]*)"', part.read(2**20))
    except (*UNREADABLE, NotImplementedError, RuntimeError):
        return None
    return [name.decode("utf-8", "replace").strip().lower() for name in names]


def renamed(faults: Iterable[Fault], tables: Mapping[str, TableText]) -> list[Fault]:
    """Return the faults under the names of the files that their tables were read from, with the sheet of a workbook
    with several."""
    return [_renamed(fault, tables) for fault in faults]


def _renamed(fault: Fault, tables: Mapping[str, TableText]) -> Fault:
    message = fault.message
    for name, table in tables.items():
        if table.of_workbook and table.source is not None:
            where = table.source.name if table.sheet is None else f"the sheet '{table.sheet}'"
            message = message.replace(name, where)
    table = tables.get(fault.file, TableText())
    file = fault.file if table.source is None else table.source.name
    return replace(fault, file=file, message=message, sheet=table.sheet or fault.sheet)


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


def _sheet_text(file: str, content: bytes, stem: str, faults: Faults) -> tuple[str | None, str | None]:
    """Return the text of the sheet of a table, and its name where that is not its file's."""
    sheet = read_sheet(file, content, stem, faults, or_first=file != WORKBOOK)
    if sheet is None:
        return None, None
    rows = sheet.rows
    width = max((index + 1 for index, cell in enumerate(rows[0] if rows else []) if cell), default=0)
    if len(sheet.names) > 1 and sheet.name.strip().casefold() != stem and (width < 2 or len(rows) < 2):
        faults.add(
            file, None, None,
            f"the first sheet, '{sheet.name}', was read, since none is called '{stem}', and it holds no table; call "
            f"the sheet of the table '{stem}'; there are {listed(sheet.names)}",
        )  # fmt: skip
        return None, None
    # A row ends with its last cell that was ever filled; what stands beside the table is a fault of its row.
    cut = [
        [*row, *[""] * (width - len(row))][:width] + [cell for cell in row[width:] if cell] for row in rows
    ]
    text = _written(cut).rstrip("\n")
    if not text:
        faults.add(file, None, None, f"the sheet of '{stem}' is empty; its first row names the columns")
        return None, None
    return text + "\n", sheet.name if len(sheet.names) > 1 else None
