"""``runs.csv``: the runs of the plan, when they started, and their conditions."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from monitor.readers.campaign.recorded_columns import recorded_columns
from monitor.readers.faults import Faults, quoted
from monitor.readers.tables.csv_table import CsvTable, refuse_missing
from monitor.readers.tables.csv_values import Numbers, Wholes, numbers, wholes
from monitor.records import Run

FILE = "runs.csv"
PLAN = ("run", "started_at", "day", "warm_up")
AMBIENT = "ambient_degC"
# ISO 8601-1:2019, 5.4: date and time of day, extended format, with the shift from UTC.
MOMENT = re.compile(
    r"[0-9]{4}-[0-9]{2}-[0-9]{2}[T ][0-9]{2}:[0-9]{2}(:[0-9]{2}([.,][0-9]{1,6})?)?(Z|[+-][0-9]{2}(:?[0-9]{2})?)?"
)
EXAMPLE = "2026-03-02T08:37:06-05:00"
#: No machine of this kind was measured before; a date beyond either year is a slip.
YEARS = (1900, 2999)


@dataclass(frozen=True)
class RunsPart:
    """The runs that could be read, and the line of every run number that is listed."""

    runs: tuple[Run, ...]
    lines: dict[int, int]


def read_runs(table: CsvTable, faults: Faults, *, ambient: bool = True) -> RunsPart | None:
    """Read the runs; None where the column of their numbers is missing. ``ambient`` is whether each must have the
    ambient temperature; else the column may be empty or missing."""
    required = (*PLAN, AMBIENT)
    named = refuse_missing(table, required if ambient else PLAN, faults)
    recorded = recorded_columns(table, required, faults, named)
    conditions = _conditions(table, recorded, faults, ambient=ambient)
    day = wholes(table, "day", faults) if "day" in table.columns else None
    warm_up = _truths(table, faults) if "warm_up" in table.columns else None
    started = _moments(table, faults) if "started_at" in table.columns else None
    if "run" not in table.columns:
        return None
    rows = _rows_of_runs(table, wholes(table, "run", faults), faults)
    lines = {number: table.lines[row] for number, row in rows.items()}
    if day is None or warm_up is None or started is None:
        return RunsPart((), lines)
    runs: list[Run] = []
    for number, row in rows.items():
        moment, warm = started[row], warm_up[row]
        if moment is not None and warm is not None and day.good[row]:
            runs.append(Run(number, moment, int(day.values[row]), warm, _recorded(conditions, row)))
    return RunsPart(tuple(runs), lines)


def _conditions(
    table: CsvTable, recorded: Sequence[str], faults: Faults, *, ambient: bool
) -> dict[str, Numbers]:
    """Return the columns of the ambient temperature and of all else that was recorded."""
    names = [AMBIENT, *recorded] if AMBIENT in table.columns else recorded
    return {name: numbers(table, name, faults, may_be_empty=name != AMBIENT or not ambient) for name in names}


def _recorded(conditions: Mapping[str, Numbers], row: int) -> dict[str, float]:
    """Return the conditions of a run whose cells are not empty."""
    values = {name: float(column.values[row]) for name, column in conditions.items()}
    return {name: value for name, value in values.items() if not math.isnan(value)}


def _rows_of_runs(table: CsvTable, run: Wholes, faults: Faults) -> dict[int, int]:
    """Return the row of every run number; one that is listed again is refused."""
    rows: dict[int, int] = {}
    for row, number in enumerate(run.values.tolist()):
        if not run.good[row]:
            continue
        if number in rows:
            first = table.lines[rows[number]]
            message = f"run {number} is listed twice, first on line {first}; list it once"
            faults.add(FILE, table.lines[row], "run", message)
        else:
            rows[number] = row
    return rows


def _truths(table: CsvTable, faults: Faults) -> list[bool | None]:
    truths = [{"true": True, "false": False}.get(cell) for cell in table.columns["warm_up"]]
    for line, cell, truth in zip(table.lines, table.columns["warm_up"], truths, strict=True):
        if truth is None:
            faults.add(FILE, line, "warm_up", f"{quoted(cell)} is neither; write true or false")
    return truths


def _moments(table: CsvTable, faults: Faults) -> list[datetime | None]:
    moments = [
        _moment(line, cell, faults, of_workbook=table.of_workbook)
        for line, cell in zip(table.lines, table.columns["started_at"], strict=True)
    ]
    _refuse_backwards(table.lines, moments, faults)
    return moments


def _moment(line: int, cell: str, faults: Faults, *, of_workbook: bool) -> datetime | None:
    asked = f"write for example {EXAMPLE}"
    if of_workbook:
        asked = f"write it as text (number format Text), for example {EXAMPLE}: a date of Excel's own holds no offset"
    wrong = f"{quoted(cell)} is not a time in ISO 8601 with an offset; {asked}"
    if match := MOMENT.fullmatch(cell):
        try:
            moment = datetime.fromisoformat(cell)
        except ValueError as error:
            wrong = f"{quoted(cell)} is not a time: {error}; write for example {EXAMPLE}"
        else:
            if match[3] is not None and YEARS[0] <= moment.year <= YEARS[1]:
                return moment
            if match[3] is not None:
                wrong = f"{quoted(cell)} is not in the years {YEARS[0]} to {YEARS[1]}"
            else:
                wrong = f"{quoted(cell)} has no offset from UTC; {asked}"
    faults.add(FILE, line, "started_at", wrong)
    return None


def _refuse_backwards(lines: Sequence[int], moments: Sequence[datetime | None], faults: Faults) -> None:
    before: tuple[int, datetime] | None = None
    for line, moment in zip(lines, moments, strict=True):
        if moment is None:
            continue
        if before is not None and moment < before[1]:
            faults.add(
                FILE,
                line,
                "started_at",
                f"time runs backwards: {moment.isoformat()} is before {before[1].isoformat()} "
                f"on line {before[0]}; list the runs in the order in which they started",
            )
        before = (line, moment)
