"""Any table of text or of Excel, as R-tests, trackers, lasers and ball bars export it.

What stands above the table (``Operator: Smith``) is kept as facts. Units stand in the header (``X [mm]``, ``X (mm)``,
``x_mm``), in a line of units below it, or in the mapping.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from monitor.exceptions import did_you_mean
from monitor.readers.export import Export, ExportFile, ExportFormat, Fact
from monitor.readers.faults import Faults, one_of, quoted
from monitor.readers.foreign_units import foreign_unit
from monitor.readers.tables.delimited import (
    DECIMALS,
    SEPARATORS,
    Style,
    cells_of,
    fact_of,
    first_row,
    is_number,
    name_and_unit,
    separator_of,
    with_points,
)
from monitor.readers.tables.foreign_text import decode_foreign
from monitor.readers.tables.workbook import read_sheet
from monitor.readers.toml_table import Table

#: Words that begin a line below a table and are a result over its rows.
_RESULTS = frozenset((
    "mean", "average", "avg", "max", "maximum", "min", "minimum", "range", "sum", "total", "totals", "median", "rms",
    "std", "stdev", "std dev", "std.dev", "standard deviation", "sigma", "peak to peak", "mittel", "mittelwert",
    "summe", "gesamt", "spannweite", "streuung", "standardabweichung", "durchschnitt", "mw",
))  # fmt: skip
_WORKBOOKS = (".xlsx", ".xlsm")
#: What a date at the head of an export is called.
_DATES = ("date", "datum", "date/time", "started", "start", "time", "measured", "messdatum")


@dataclass(frozen=True)
class TableSettings:
    """What the mapping says of a table: style, line of the header (0: none), sheet of a workbook."""

    style: Style = field(default_factory=Style)
    header_line: int | None = None
    sheet: str | None = None


@dataclass(frozen=True)
class _Head:
    """The header of a table: names and units of the columns, the index of the first line of the rows, and that of the
    header, above which facts stand."""

    names: list[str]
    units: dict[str, str]
    begin: int
    header: int


def settings(table: Table) -> TableSettings:
    """Read the keys of a table: ``separator``, ``decimal``, ``header_line``, ``sheet``."""
    separator = choice(table, "separator", SEPARATORS)
    decimal = choice(table, "decimal", DECIMALS)
    header = table.raw("header_line", required=False, example="1")
    if header is not None and (type(header) is not int or not 0 <= header < 1000):
        table.fault(
            "header_line",
            f"{quoted(header)} is no line; write the number of the header's line, or 0 for none",
        )
        header = None
    return TableSettings(Style(separator, decimal), header, table.text("sheet", example='"Data"'))


def _one_line(cell: str) -> str:
    """Return a cell of a workbook without the tabs that separate cells here."""
    return cell.replace("\t", " ")


def choice(table: Table, key: str, choices: dict[str, str]) -> str | None:
    """Return what a word of a key stands for; None where the key is absent or its word unknown."""
    word = table.text(key, example=f'"{next(iter(choices))}"')
    if word is None or word in choices:
        return choices.get(word or "")
    table.fault(
        key, f"{quoted(word)} is not known; {did_you_mean(word, choices)}write one of {one_of(choices)}"
    )
    return None


def read(file: ExportFile, how: TableSettings, faults: Faults) -> Export | None:
    """Read the one table of a file; None with the faults noted."""
    if file.name.casefold().endswith(_WORKBOOKS):
        sheet = read_sheet(file.name, file.content, how.sheet, faults)
        text = None if sheet is None else "\n".join("\t".join(map(_one_line, row)) for row in sheet.rows)
        encoding, style = "workbook of Excel", Style("\t", ".")
    else:
        decoded = decode_foreign(file.name, file.content, faults)
        text, encoding = decoded or (None, "")
        style = how.style
    return None if text is None else read_text(file.name, text, encoding, style, how.header_line, faults)


def read_text(
    name: str, text: str, encoding: str, style: Style, header_line: int | None, faults: Faults
) -> Export | None:
    """Read the one table of a text; None with the faults noted."""
    lines = text.split("\n")
    separator = style.separator or separator_of(lines)
    begin = None if separator is None else first_row(lines, separator)
    if separator is None or begin is None:
        line, cell = _with_its_unit(lines)
        what = (
            "there is no table of numbers in the first 400 lines; say in the mapping how it is written: separator = "
            '"semicolon", header_line = 12'
        )
        if cell is not None:
            what = (
                f"{quoted(cell)} has its unit behind the number; export numbers alone, with the unit in the header: "
                "Position [mm]"
            )
        faults.add(name, line, None, what)
        return None
    before = len(faults)
    head = _head(name, lines, separator, begin, header_line, faults)
    if len(faults) > before:
        return None
    rows, at = _rows(name, lines, separator, head, faults)
    if not rows:
        return None
    plain, decimal = with_points(name, rows, at, Style(separator, style.decimal), faults)
    facts = tuple(
        Fact(*fact, number)
        for number, line in enumerate(lines[: head.header], start=1)
        if (fact := fact_of(line)) is not None
    )
    started = next((fact.value for fact in facts if fact.key.casefold() in _DATES), None)
    columns = dict(zip(head.names, zip(*plain, strict=True), strict=True))
    layout = f"{encoding}, {Style(separator, decimal)}"
    return Export(
        columns,
        head.units,
        at,
        layout,
        facts,
        started,
        tuple(_taken_as_names(rows, at)),
        _repeated(plain, at),
    )


def _head(
    name: str, lines: Sequence[str], separator: str, begin: int, header_line: int | None, faults: Faults
) -> _Head:
    width = len(cells_of(lines[begin], separator))
    numbered = [str(number + 1) for number in range(width)]
    if header_line == 0:
        return _Head(numbered, {}, begin, begin)
    above = [index for index in range(begin) if lines[index].strip()]
    index = above[-1] if header_line is None and above else (header_line or 0) - 1
    if not 0 <= index < begin:
        what = (
            "there is no line of names above the numbers"
            if header_line is None
            else f"line {header_line} is no header"
        )
        faults.add(
            name,
            begin + 1,
            None,
            f"{what}; write header_line = 0 and name the columns 1, 2, ... in the mapping",
        )
        return _Head(numbered, {}, begin, begin)
    cells = _padded(cells_of(lines[index], separator), width)
    units: dict[str, str] = {}
    if header_line is None and len(above) > 1 and _are_units(cells):
        units, index = _units_below(cells), above[-2]
        cells = _padded(cells_of(lines[index], separator), width)
    if len(cells) != width or any(is_number(cell) for cell in cells):
        faults.add(
            name, index + 1, None,
            f"the header has {len(cells)} names where the rows have {width} cells; say in the mapping which line it is "
            "(header_line = 3), or header_line = 0 and name the columns 1, 2, ...",
        )  # fmt: skip
        return _Head(numbered, {}, begin, begin)
    return _named(cells, units, begin, index)


def _units_below(cells: Sequence[str]) -> dict[str, str]:
    """Return the units of a line of units by the number of their column."""
    return {str(number): cell for number, cell in enumerate(cells) if foreign_unit(cell.strip("[]()"))}


def _named(cells: Sequence[str], units: dict[str, str], begin: int, header: int) -> _Head:
    """Return the header; a name that stands twice keeps its whole cell, and an empty one its number."""
    parts = [name_and_unit(cell) for cell in cells]
    short = [part.casefold() for part, _ in parts]
    names: list[str] = []
    stated: dict[str, str] = {}
    for number, (cell, (stem, unit)) in enumerate(zip(cells, parts, strict=True)):
        label = stem if stem and short.count(stem.casefold()) == 1 else cell
        label = label if label and label not in names else f"{label or 'column'} {number + 1}"
        names.append(label)
        if unit is not None or str(number) in units:
            stated[label] = unit or units[str(number)].strip("[]()")
    return _Head(names, stated, begin, header)


def _rows(
    name: str, lines: Sequence[str], separator: str, head: _Head, faults: Faults
) -> tuple[list[list[str]], list[int]]:
    width = len(head.names)
    titles = _padded(cells_of(lines[head.header], separator), width) if head.header < head.begin else None
    rows: list[list[str]] = []
    at: list[int] = []
    for number, line in enumerate(lines[head.begin :], start=head.begin + 1):
        if not line.strip(" \t;,"):
            continue
        cells = _padded(cells_of(line, separator), width)
        if titles is not None and _names(cells) == _names(titles):
            faults.add(
                name, number, None,
                f"the header of line {head.header + 1} stands here again: two measurements are joined; split the file "
                "here, and give each part its run",
            )  # fmt: skip
            return [], []
        if len(cells) == width:
            rows.append(cells)
            at.append(number)
        else:
            faults.add(
                name, number, None,
                f"{len(cells)} {'cell' if len(cells) == 1 else 'cells'} where the table has {width}; the file is cut "
                "here, or something else than a row stands here: remove the line or export again",
            )  # fmt: skip
    result = _result(rows, at)
    if result is not None and _begin_with_numbers(rows):
        word, number = result
        faults.add(
            name, number, None,
            f"{quoted(word)} begins a line of results and no row; remove it and those like it, or export the rows "
            "alone",
        )  # fmt: skip
    return rows, at


def _names(cells: Sequence[str]) -> list[str]:
    """Return the names of a header without their units, in small letters."""
    return [name_and_unit(cell)[0].casefold() for cell in cells]


def _first(row: Sequence[str]) -> str:
    """Return the first cell of a row that is not empty."""
    return next((cell for cell in row if cell), "")


def _is_result(word: str) -> bool:
    return word.strip(" :=.").casefold() in _RESULTS


def _result(rows: Sequence[Sequence[str]], lines: Sequence[int]) -> tuple[str, int] | None:
    """Return the first word that begins a row and may mean a result over the others, and its line."""
    firsts = zip(map(_first, rows), lines, strict=True)
    return next(((word, line) for word, line in firsts if _is_result(word)), None)


def _begin_with_numbers(rows: Sequence[Sequence[str]]) -> bool:
    """Return whether most rows but results begin with a number, a date or a time; else names stand there, as MAX."""
    firsts = [first for row in rows if not _is_result(first := _first(row))]
    return 2 * sum(first.lstrip("+-.,")[:1].isdigit() for first in firsts) > len(firsts)


def _taken_as_names(rows: Sequence[Sequence[str]], lines: Sequence[int]) -> list[str]:
    """Return a sentence on a row of names whose name may mean a result over the others."""
    result = _result(rows, lines)
    if result is None:
        return []
    word, line = result
    return [
        f"{quoted(word)} on line {line} is read as a row, since names begin the others; is it a result over them?"
    ]


def _with_its_unit(lines: Sequence[str]) -> tuple[int, str | None]:
    """Return the first line with two numbers or more that have their unit behind them, and the first of these."""
    for number, line in enumerate(lines[:400], start=1):
        for separator in SEPARATORS.values():
            cells = [cell for cell in cells_of(line, separator) if _is_with_unit(cell)]
            if len(cells) > 1:
                return number, cells[0]
    return 1, None


def _is_with_unit(cell: str) -> bool:
    number, _, unit = cell.partition(" ")
    return is_number(number) and foreign_unit(unit) is not None


def _padded(cells: list[str], width: int) -> list[str]:
    """Return the cells of a line without those that are empty at its end and beyond the table."""
    while len(cells) > width and not cells[-1]:
        cells = cells[:-1]
    return cells


def _are_units(cells: Sequence[str]) -> bool:
    """Return whether a line below the header holds the units of the columns."""
    stated = [cell for cell in cells if cell]
    return bool(stated) and all(cell[0] in "[(" or foreign_unit(cell.strip("[]()")) for cell in stated)


def _repeated(rows: Sequence[Sequence[str]], lines: Sequence[int]) -> tuple[int, ...]:
    """Return the lines of the rows that equal another in every cell."""
    first: dict[tuple[str, ...], int] = {}
    return tuple(
        line for line, row in zip(lines, rows, strict=True) if first.setdefault(tuple(row), line) != line
    )


EXPORT = ExportFormat(
    "table",
    "a table of text (CSV, tabs, spaces) or of Excel with a header",
    read,
    settings,
    (".csv", ".txt", ".tsv", ".xlsx", ".xlsm"),
)
