"""A CSV file as columns of text, one line a row, so that every message can name its line."""

from __future__ import annotations

import csv
import re
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from monitor.exceptions import closest
from monitor.readers.faults import Faults, one_of, quoted
from monitor.readers.foreign_units import foreign_unit
from monitor.readers.tables.cut_files import CUT, is_cut
from monitor.readers.tables.delimited import is_number
from monitor.readers.tables.packed_cells import CELLS_AT_ONCE, PackedCells
from monitor.readers.tables.spreadsheet import plain_csv

#: Lines at the top of a file among which the head may stand under a title.
LOOKED_AT = 8
_NAME = re.compile(r"[A-Za-z]\w*")
#: Longest line, in characters; a row of the examples has 70.
LONGEST_LINE = 65_536
#: Most lines of one file: two years of touching without a pause, at one touch a minute.
MOST_LINES = 1_000_000


@dataclass(frozen=True)
class CsvTable:
    """A file's cells: column name to the cells of every whole row, and the line that each row stands on.

    ``damaged`` holds the rows that do not have the header's number of cells; ``of_workbook`` is whether a spreadsheet
    held the cells, which has no text between them.
    """

    file: str
    columns: dict[str, Sequence[str]]
    lines: Sequence[int]
    damaged: tuple[tuple[str, ...], ...]
    of_workbook: bool = False

    def __len__(self) -> int:
        return len(self.lines)


def parse_csv(file: str, text: str, faults: Faults, *, of_workbook: bool = False) -> CsvTable | None:
    """Parse RFC 4180 with one line a row, or what a spreadsheet of a country with decimal commas writes.

    None where the header cannot be used; the faults are noted.
    """
    if text.count("\n") > MOST_LINES:
        faults.add(file, None, None, f"the file has more than {MOST_LINES} lines; split the campaign")
        return None
    if is_cut(text):
        faults.add(file, text.count("\n") + 1, None, CUT)
        return None
    lines = plain_csv(file, text, faults).split("\n")
    while lines and not lines[-1].strip("\r"):
        lines.pop()
    lines = _without_empty_columns(lines)
    longest = max(range(len(lines)), key=lambda index: len(lines[index]), default=None)
    if longest is None:
        faults.add(file, 1, None, "the file is empty; its first line names the columns")
        return None
    if len(lines[longest]) > LONGEST_LINE:
        faults.add(
            file, longest + 1, None, f"the line is longer than {LONGEST_LINE} characters; end each row's line"
        )
        return None
    try:
        header = _cells(lines[0])
    except csv.Error as error:
        faults.add(file, 1, None, f"the header cannot be read: {_what(error)}")
        return None
    head = _line_of_head(header, lines)
    if head is not None:
        faults.add(
            file,
            1,
            None,
            f"the head seems to be in line {head}; take away what stands above it: line 1 names the columns",
        )
        return None
    if not _header_is_sound(file, header, faults):
        return None
    return _body(file, header, lines, faults, of_workbook=of_workbook)


def _without_empty_columns(lines: list[str]) -> list[str]:
    """Return the lines without the columns at the right that hold nothing, name included, as spreadsheets save them."""
    head = lines[0].rstrip(", \t\r") if lines else ""
    count = lines[0][len(head) :].count(",") if head else 0
    if not count:
        return lines
    without = []
    for line in lines:
        named, *cut = line.rsplit(",", count)
        if line.strip() and (len(cut) < count or any(map(str.strip, cut))):
            return lines
        without.append(named)
    return without


def _line_of_head(header: Sequence[str], lines: Sequence[str]) -> int | None:
    """Return the line of the names of the columns where a title stands above them; None where line 1 has them."""
    named = sum(map(bool, header))
    for number, line in enumerate(lines[1:LOOKED_AT], start=2):
        try:
            cells = _cells(line)
        except csv.Error:
            return None
        if (
            len(cells) > 2 * max(named, 1)
            and len(set(cells)) == len(cells)
            and all(map(_NAME.fullmatch, cells))
        ):
            return number
    return None


def refuse_missing(table: CsvTable, required: Sequence[str], faults: Faults) -> frozenset[str]:
    """Note every required column that the header lacks, and the one that may be it under another name; return these."""
    other_names = _misspelt(table, required)
    for column in required:
        if column not in table.columns:
            hint = f"is it {quoted(other_names[column])}? " if column in other_names else ""
            message = f"the column is missing; {hint}the header needs {one_of(required)}"
            faults.add(table.file, 1, column, message)
    return frozenset(other_names.values())


def _misspelt(table: CsvTable, required: Sequence[str]) -> dict[str, str]:
    """Return the column that is likely meant for each required one that the header lacks, where a name is close."""
    unused = [name for name in table.columns if name not in required]
    missing = [column for column in required if column not in table.columns]
    return {column: name for column in missing if (name := closest(column, unused)) is not None}


def _header_is_sound(file: str, header: list[str], faults: Faults) -> bool:
    if not header:
        faults.add(file, 1, None, "the line is empty; line 1 names the columns")
        return False
    sound = True
    names: set[str] = set()
    for number, name in enumerate(header, start=1):
        wrong = None
        if not name:
            wrong = f"the header's cell {number} is empty; name the column or remove it"
        elif name in names:
            wrong = f"the header names the column {quoted(name)} twice; name each column once"
        elif not name.isprintable() or name != name.strip():
            wrong = f"the column name {quoted(name)} holds spaces or characters that cannot be printed"
        if wrong is not None:
            faults.add(file, 1, name if name and name.isprintable() else None, wrong)
            sound = False
        names.add(name)
    if sound and len(header) == 1 and any(mark in header[0] for mark in ";\t|"):
        faults.add(file, 1, None, "the header has one cell; separate the cells by commas")
        return False
    return sound


def _body(file: str, header: list[str], lines: list[str], faults: Faults, *, of_workbook: bool) -> CsvTable:
    columns = [PackedCells() for _ in header]
    rows: list[list[str]] = []
    # A list of a million numbers takes 40 MB.
    at = array("q")
    damaged: list[tuple[str, ...]] = []
    width = len(header)
    for number, row in _rows(lines):
        if isinstance(row, csv.Error):
            faults.add(file, number, None, _what(row))
            damaged.append(())
            continue
        is_whole = len(row) == width
        # Of a million rows those alone are looked at that may be none.
        may_be_none = number == 2 or not is_whole or not row[-1] or not row[0]
        if may_be_none and (why := _why_no_row(number, row, width)):
            faults.add(file, number, None, why)
        elif is_whole:
            rows.append(row)
            at.append(number)
            if len(rows) == CELLS_AT_ONCE:
                _move(rows, columns)
        else:
            hint = "; is a comma used as decimal point?" if len(row) > width and not of_workbook else ""
            faults.add(file, number, None, f"{len(row)} cells where the header has {width}{hint}")
            damaged.append(tuple(row[:width]))
    if not at and not damaged:
        faults.add(file, 1, None, "there is only a header; at least one row must follow")
    _move(rows, columns)
    return CsvTable(file, dict(zip(header, columns, strict=True)), at, tuple(damaged), of_workbook)


def _move(rows: list[list[str]], columns: list[PackedCells]) -> None:
    """Put rows at the end of the columns and empty their list: all at once they would be twice in memory."""
    for column, cells in zip(columns, zip(*rows, strict=True), strict=False):
        column.extend(cells)
    rows.clear()


def _why_no_row(number: int, row: list[str], width: int) -> str:
    """Return why a line is no row: nothing in it, units under the head, a remark; empty where it may be one."""
    cells = [cell.strip() for cell in row if cell.strip()]
    if not cells:
        return "the line is empty; remove it"
    if (
        number == 2
        and not any(map(is_number, cells))
        and any(foreign_unit(cell.strip("[]()")) for cell in cells)
    ):
        return "this is a row of units; remove it: the names of the columns have their units"
    if len(cells) == 1 and width > 2 and not is_number(cells[0]) and cells[0] == row[0].strip():
        return f"this is no row of the table, only {quoted(cells[0])}; remove it, or fill its cells"
    return ""


def _rows(lines: list[str]) -> Iterator[tuple[int, list[str] | csv.Error]]:
    """Yield every line after the header with its number, and take it out of the list. A quote has to close on its
    line."""
    is_plain = not any('"' in line or "\r" in line[:-1] for line in lines[1:])
    body = _taken_out(lines)
    next(body)
    if is_plain:
        yield from enumerate(csv.reader(body), start=2)
        return
    for number, line in enumerate(body, start=2):
        try:
            yield number, _cells(line)
        except csv.Error as error:
            yield number, error


def _taken_out(lines: list[str]) -> Iterator[str]:
    """Yield the lines in their order, each of which is then no longer in the list."""
    lines.reverse()
    while lines:
        yield lines.pop()


def _cells(line: str) -> list[str]:
    return next(csv.reader([line], strict=True), [])


def _what(error: csv.Error) -> str:
    reason = str(error)
    if "unexpected end of data" in reason:
        return 'a quote is opened and not closed on this line; close it, and write a quote in a cell as ""'
    if "expected after" in reason:
        return 'text follows a closing quote; put a comma there, or write a quote in a cell as ""'
    if "new-line" in reason:
        return "a carriage return inside the line; end lines with LF or CRLF"
    return f"the line cannot be read: {reason}"
