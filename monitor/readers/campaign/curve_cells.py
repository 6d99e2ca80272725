"""Cells and rows of a curve that no measurement can have: dates among dates that are none, enormous numbers, copies."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime

import numpy as np

from monitor.readers.faults import Faults, quoted
from monitor.readers.tables.csv_table import CsvTable
from monitor.records import Array

#: No instrument shows more than this in the units of a column; powers of larger numbers leave double precision.
LARGEST_NUMBER = 1e15
ISO_DATE = re.compile(r"\d{4}-\d\d-\d\d")
#: A date as many countries write it, whose order of day and month nobody can know: 02.03.2026 or 3/2/26.
OTHER_DATE = re.compile(r"\s*\d{1,2}[./]\d{1,2}[./](\d{4}|\d\d)\b")


def days_of(cells: Sequence[str]) -> Array | None:
    """Return the days since the first row, of dates in ISO 8601 with or without a time; None where they are none."""
    moments = []
    for cell in cells:
        if not re.match(r"\d{4}-\d\d-\d\d", cell):
            return None
        try:
            moment = datetime.fromisoformat(cell)
        except ValueError:
            return None
        moments.append(moment)
    aware = [moment.tzinfo is not None for moment in moments]
    if any(aware) and not all(aware):
        return None
    first = min(moments)
    return np.array([(moment - first).total_seconds() / 86400.0 for moment in moments])


def are_dates(cells: Sequence[str]) -> bool:
    """Return whether most cells are meant as dates: one mistyped date does not make a column of words."""
    return 2 * sum(bool(OTHER_DATE.match(cell)) or _what_is_wrong(cell) is None for cell in cells) > len(
        cells
    )


def refuse_dates(table: CsvTable, name: str, faults: Faults) -> None:
    """Note every cell that is no date in a column of dates, or that only some of them have a time zone."""
    before = len(faults)
    for line, cell in zip(table.lines, table.columns[name], strict=True):
        wrong = _what_is_wrong(cell)
        if wrong is not None:
            faults.add(table.file, line, name, wrong)
    if len(faults) == before:
        faults.add(
            table.file,
            None,
            name,
            "some moments have a time zone and some have none; write it in every row, such as "
            "2026-03-02T08:00+01:00, or in none",
        )


def _what_is_wrong(cell: str) -> str | None:
    asked = "write 2026-03-02 or 2026-03-02T08:00 (year, month, day)"
    if OTHER_DATE.match(cell):
        return f"{quoted(cell)}: countries differ in the order of day and month; {asked}"
    if not ISO_DATE.match(cell):
        return f"{quoted(cell)} is no date, and most cells of the column are; {asked}"
    try:
        datetime.fromisoformat(cell)
    except ValueError as error:
        return f"{quoted(cell)} is no date of the calendar ({error}); {asked}"
    return None


def refuse_enormous(table: CsvTable, name: str, values: Array, faults: Faults) -> None:
    """Note every number beyond LARGEST_NUMBER; NaN, a cell refused already, is passed over."""
    for row in np.flatnonzero(np.abs(values) > LARGEST_NUMBER).tolist():
        faults.add(
            table.file,
            table.lines[row],
            name,
            f"{quoted(table.columns[name][row])} is beyond {LARGEST_NUMBER:g}, which no measurement is; correct "
            "it, or write the column in a larger unit",
        )


def refuse_copies(table: CsvTable, time: str | None, faults: Faults) -> None:
    """Note a table that has every row more than once, to the last character of their time.

    Equal readings of a coarse instrument do occur, so copies are only refused where every moment has one reading
    otherwise.
    """
    if time is None:
        return
    rows = list(zip(*table.columns.values(), strict=True))
    lines: dict[tuple[str, ...], list[int]] = {}
    for line, row in zip(table.lines, rows, strict=True):
        lines.setdefault(row, []).append(line)
    moments = set(table.columns[time])
    if len(lines) < 2 or len(moments) < len(lines) or min(map(len, lines.values())) < 2:
        return
    earlier, again = next(iter(lines.values()))[:2]
    faults.add(
        table.file,
        again,
        None,
        f"the row equals that of line {earlier} in every character, its time too, and so does every other row "
        f"an earlier one: {len(rows)} rows hold {len(lines)} measurements; remove the copies",
    )
