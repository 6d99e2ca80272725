"""Tables in the text of foreign programs: what separates the cells, where the table begins, what its commas mean."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass

from monitor.readers.export import Fact
from monitor.readers.faults import Faults, quoted
from monitor.readers.foreign_units import decimal_of, foreign_unit, sexagesimal

SEPARATORS = {"semicolon": ";", "tab": "\t", "comma": ",", "space": " "}
DECIMALS = {"comma": ",", "point": "."}
_NUMBER = re.compile(r"[+-]?([0-9]+([.,][0-9]*)?|[.,][0-9]+)([eE][+-]?[0-9]+)?")
_COMMA = re.compile(r"[+-]?([0-9]+,[0-9]*|,[0-9]+)([eE][+-]?[0-9]+)?")
#: Whole numbers that a mark cuts into groups of three digits; a decimal number of three digits looks alike.
_GROUPED = re.compile(r"[+-]?[1-9][0-9]{0,2}([.,][0-9]{3})+")
_POINT = re.compile(r"[+-]?([0-9]+\.[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
#: ``Position [mm]``, ``Position (mm)``, ``Position / mm``, ``Position in mm``.
_WITH_UNIT = re.compile(
    r"(?P<name>.*?\S)\s*(?:\[(?P<a>[^\]]*)\]|\((?P<b>[^)]*)\)|\s/\s*(?P<c>\S+)|\sin\s+(?P<d>\S+))"
)
_QUANTITY = re.compile(r"([+-]?[0-9]*[.,]?[0-9]+)\s*([^\s0-9]\S*)?")
#: Lines at the head of a file in which a table has to begin.
_LOOKED_AT = 400


@dataclass(frozen=True)
class Style:
    """How a table is written: its separator and its decimal mark, None where nobody knows yet."""

    separator: str | None = None
    decimal: str | None = None

    def __str__(self) -> str:
        names = {mark: name for name, mark in SEPARATORS.items()}
        marks = {mark: name for name, mark in DECIMALS.items()}
        separator = "cells separated by " + {"space": "spaces"}.get(
            names[self.separator or ","], names[self.separator or ","] + "s"
        )
        return f"{separator}, decimal {marks[self.decimal or '.']}"


def cells_of(line: str, separator: str) -> list[str]:
    """Return the cells of a line without spaces around them; quotes that do not close leave the line as one cell."""
    if separator == " ":
        return line.split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, strict=True), [])]
    except csv.Error:
        return [line]


def is_number(cell: str) -> bool:
    """Return whether a cell is a number with a decimal point or comma."""
    return _NUMBER.fullmatch(cell) is not None


def is_data(cells: Sequence[str]) -> bool:
    """Return whether a line is one of numbers: two or more cells, the half of them numbers.

    Two or more angles in degrees, minutes and seconds count too; one alone may be the time of day of a head.
    """
    numbers, angles = sum(map(is_number, cells)), sum(sexagesimal(cell) is not None for cell in cells)
    numbers += angles if angles > 1 else 0
    return len(cells) > 1 and 2 * numbers >= len([cell for cell in cells if cell]) > 0


def separator_of(lines: Sequence[str]) -> str | None:
    """Return the mark that makes most lines rows of numbers with equal numbers of cells; None where none does."""
    best, most = None, 0
    for mark in SEPARATORS.values():
        rows = [cells_of(line, mark) for line in lines[:_LOOKED_AT]]
        widths = [len(cells) for cells in rows if is_data(cells)]
        count = max((widths.count(width) for width in set(widths)), default=0)
        if count > most:
            best, most = mark, count
    return best


def first_row(lines: Sequence[str], separator: str) -> int | None:
    """Return the index of the first row of numbers that the next row, where there is one, has the same width as."""
    for index, line in enumerate(lines[:_LOOKED_AT]):
        cells = cells_of(line, separator)
        if is_data(cells):
            following = [
                cells_of(other, separator) for other in lines[index + 1 : index + 20] if other.strip()
            ]
            if not following or len(following[0]) == len(cells):
                return index
    return None


def with_points(
    file: str, rows: Sequence[Sequence[str]], lines: Sequence[int], style: Style, faults: Faults
) -> tuple[list[list[str]], str]:
    """Return the cells with decimal points, and the decimal mark of the file.

    Where nothing says what a comma is, a file that has numbers with commas and numbers with points is refused: "1,234"
    may be one and a bit or a thousand.
    """
    decimal = style.decimal or ("." if style.separator == "," else _decimal_mark(file, rows, lines, faults))
    if decimal == ".":
        return [list(row) for row in rows], decimal
    return [
        [cell.replace(",", ".") if _COMMA.fullmatch(cell) else cell for cell in row] for row in rows
    ], decimal


def _decimal_mark(file: str, rows: Sequence[Sequence[str]], lines: Sequence[int], faults: Faults) -> str:
    """Return the decimal mark by the numbers themselves, with a fault where they do not say it."""
    comma = _first_of(rows, lines, _COMMA)
    point = _first_of(rows, lines, _POINT)
    grouped = _grouped(rows, lines)
    if comma is not None and point is not None:
        faults.add(
            file, comma[0], None,
            f"{quoted(comma[1])} has a comma and {quoted(point[1])} on line {point[0]} a point; "
            + (
                "the numbers have thousands separators: export them without"
                if grouped is not None
                else "say in the mapping which is the decimal mark: decimal = \"comma\" or decimal = \"point\""
            ),
        )  # fmt: skip
    elif grouped is not None and not _has_decimals(rows, "." if comma is None else ","):
        faults.add(
            file, grouped[0], None,
            f"{quoted(grouped[1])} may have a decimal mark or a thousands separator, as others of its column are "
            'whole; export it without, or say in the mapping which is the decimal mark: decimal = "comma" or '
            'decimal = "point"',
        )  # fmt: skip
    return "." if comma is None else ","


def _grouped(rows: Sequence[Sequence[str]], lines: Sequence[int]) -> tuple[int, str] | None:
    """Return the first number of a column whose numbers are whole below 1000 or have groups of three digits."""
    for column in zip(*rows, strict=True):
        numbers = [cell for cell in column if is_number(cell)]
        groups = [cell for cell in numbers if _GROUPED.fullmatch(cell)]
        whole = [cell for cell in numbers if cell.lstrip("+-").isdigit()]
        if groups and whole and len(groups) + len(whole) == len(numbers) and max(map(_size, whole)) < 1000:
            return lines[column.index(groups[0])], groups[0]
    return None


def _has_decimals(rows: Sequence[Sequence[str]], mark: str) -> bool:
    """Whether a number of any column shows that the mark is a decimal one: it has other than groups of three digits."""
    cells = (cell for row in rows for cell in row if mark in cell)
    return any(is_number(cell) and not _GROUPED.fullmatch(cell) for cell in cells)


def _size(cell: str) -> int:
    return int(cell.lstrip("+-")[:9])


def _first_of(
    rows: Sequence[Sequence[str]], lines: Sequence[int], kind: re.Pattern[str]
) -> tuple[int, str] | None:
    for line, row in zip(lines, rows, strict=True):
        for cell in row:
            if kind.fullmatch(cell):
                return line, cell
    return None


def name_and_unit(header: str) -> tuple[str, str | None]:
    """Return the name of a column and the unit that its header states: ``("Position", "mm")``."""
    match = _WITH_UNIT.fullmatch(header)
    if match is not None:
        unit = next((text for text in match.group("a", "b", "c", "d") if text is not None), "")
        if foreign_unit(unit) is not None:
            return match["name"], unit.strip()
    stem, _, suffix = header.rpartition("_")
    if stem and foreign_unit(suffix) is not None:
        return stem, suffix
    return header, None


def plain_key(key: str) -> str:
    """Return a key of a head in small letters, without its unit or a mark of comments: ``# Radius (mm)`` is radius."""
    return re.sub(r"\s*[\[(].*", "", key).strip("#%*/ ").casefold()


def fact_of(line: str) -> tuple[str, str] | None:
    """Return the key and the value of a line ``key: value`` or ``key = value``; None for any other."""
    marks = sorted((line.index(mark), mark) for mark in (":", "=", ";", "\t") if mark in line)
    for _, mark in marks:
        key, _, value = line.partition(mark)
        if key.strip() and value.strip(" ;\t,") and len(key) <= 60:
            return key.strip(' "'), value.strip(' ;\t,"')
    return None


def length_of(fact: Fact) -> tuple[float | None, float | None]:
    """Return the number of a length and how many mm its unit has, behind the number or in the key; None without."""
    number, unit = quantity_of(fact)
    stated = foreign_unit(unit)
    is_length = stated is not None and stated.quantity == "length"
    return number or None, float(stated.factor) if is_length and stated else None


def quantity_of(fact: Fact) -> tuple[float | None, str]:
    """Return the number of a line of a head and its unit as it stands, behind the number or in brackets of the key."""
    match = _QUANTITY.fullmatch(fact.value)
    if match is None:
        return None, ""
    bracket = re.search(r"[\[(](.*?)[\])]", fact.key)
    number = decimal_of(match[1].replace(",", "."))
    return None if number is None else float(number), match[2] or (bracket[1] if bracket else "")
