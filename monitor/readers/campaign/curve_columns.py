"""The columns of a curve: numbers, dates or labels, each with its unit, and the column of the time."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
import numpy.typing as npt

from monitor.readers.campaign.curve_cells import (
    are_dates,
    days_of,
    refuse_copies,
    refuse_dates,
    refuse_enormous,
)
from monitor.readers.faults import Faults, quoted
from monitor.readers.tables.csv_table import CsvTable
from monitor.readers.tables.csv_values import numbers
from monitor.records import Array

DATA = "data.csv"
#: What a column's name may end in to say its unit; another unit is written in [curve.units].
UNITS = (
    "pm", "nm", "um", "mm", "cm", "m", "km", "in", "urad", "mrad", "rad", "deg", "arcsec", "s", "ms", "us", "min", "h",
    "d", "day", "week", "month", "year", "degC", "degF", "K", "mK", "N", "mN", "kN", "MN", "Nm", "kg", "g", "mg", "ug",
    "lbf", "Pa", "hPa", "kPa", "MPa", "bar", "mbar", "V", "mV", "uV", "nV", "A", "mA", "uA", "nA", "ohm", "mohm",
    "kohm", "Mohm", "Hz", "kHz", "MHz", "W", "mW", "J", "F", "uF", "nF", "pF", "H", "mH", "T", "mT", "dB", "lx", "cd",
    "mol", "percent", "ppm", "ppb", "counts", "rpm",
)  # fmt: skip
SAME_UNIT = {"day": "d"}
#: Units of time, in which a column says when a row was measured where it is the only one.
CLOCKS = ("ms", "s", "min", "h", "d", "week", "month", "year")
DATE_UNIT = "d"
NAME = re.compile(r"[A-Za-z]\w*", re.ASCII)
#: A column of whole numbers without a unit that names things (operator 1 and 2) rather than counts them: at most so
#: many different ones, with so many rows each on average. Others are listed under ``groups``.
MOST_LABELS, ROWS_A_LABEL = 6, 3


@dataclass(frozen=True)
class CurveSettings:
    """What campaign.toml says of the columns; None where it says nothing, or something wrong."""

    response: str | None
    base: str | None
    time: str | None
    groups: tuple[str, ...]
    inputs: tuple[str, ...]
    units: dict[str, str]
    uncertainty: float | None

    @property
    def numeric(self) -> set[str | None]:
        """Columns of numbers, whatever they look like: an input that the base model names is one."""
        return {self.response, self.time, *self.inputs, *NAME.findall(self.base or "")}


@dataclass
class CurveColumns:
    """Numbers (n,), labels (n,) and the unit of each number by column, and the column of the time."""

    numbers: dict[str, Array] = field(default_factory=dict)
    labels: dict[str, npt.NDArray[np.str_]] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    time: str | None = None


class _Content(Enum):
    DATES = "dates"
    DAMAGED_DATES = "dates of which some are none"
    LABELS = "labels"
    NUMBERS = "numbers"


def read_columns(table: CsvTable, settings: CurveSettings, faults: Faults) -> CurveColumns:
    """Read all columns; what no curve can have is noted among the faults."""
    columns = CurveColumns()
    dated: list[str] = []
    for name, cells in table.columns.items():
        content = _content(name, cells, settings)
        if content is _Content.DATES:
            days = days_of(cells)
            assert days is not None
            columns.numbers[name], columns.units[name] = days, DATE_UNIT
            dated.append(name)
        elif content is _Content.DAMAGED_DATES:
            refuse_dates(table, name, faults)
        elif content is _Content.LABELS:
            _refuse_empty(table, name, cells, faults)
            columns.labels[name] = np.array(cells, dtype=np.str_)
        else:
            columns.numbers[name] = numbers(table, name, faults).values
            columns.units[name] = _unit(name)
            refuse_enormous(table, name, columns.numbers[name], faults)
    columns.units |= settings.units
    columns.time = settings.time or _time_of(columns, dated, settings.response)
    _refuse_columns(table, columns, settings, faults)
    return columns


def _content(name: str, cells: Sequence[str], settings: CurveSettings) -> _Content:
    """Decide what a column holds: as campaign.toml says, else from its name and cells."""
    if name in settings.groups:
        return _Content.LABELS
    if name != settings.response:
        if days_of(cells) is not None:
            return _Content.DATES
        if are_dates(cells):
            return _Content.DAMAGED_DATES
        if _are_words(cells) and name not in settings.inputs:
            return _Content.LABELS
    if name not in settings.numeric and not _unit(name) and _are_labels(cells):
        return _Content.LABELS
    return _Content.NUMBERS


def _time_of(columns: CurveColumns, dated: Sequence[str], response: str | None) -> str | None:
    """Return the first column of dates, else the only one in a unit of time."""
    clocks = [name for name in columns.numbers if name != response and columns.units[name] in CLOCKS]
    if dated:
        return dated[0]
    return clocks[0] if len(clocks) == 1 else None


def _refuse_columns(table: CsvTable, columns: CurveColumns, settings: CurveSettings, faults: Faults) -> None:
    """Note a time that is none, rows that are copies, and a response that never changes."""
    time, response = settings.time, settings.response
    if time is not None and time not in columns.numbers and not are_dates(table.columns[time]):
        message = "the column of the time holds neither numbers nor dates such as 1980-02-05"
        faults.add(DATA, 1, time, message)
    if not len(faults):
        refuse_copies(table, columns.time, faults)
    if not len(faults) and response in columns.numbers and np.ptp(columns.numbers[response]) == 0.0:
        message = "the response is the same in every row: there is nothing to explain"
        faults.add(DATA, None, response, message)


def _refuse_empty(table: CsvTable, name: str, cells: Sequence[str], faults: Faults) -> None:
    for line, cell in zip(table.lines, cells, strict=True):
        if not cell.strip() or not cell.isprintable():
            faults.add(DATA, line, name, "the cell is empty or cannot be printed; a label is needed")
        elif cell != cell.strip():
            wrong = f"the label {quoted(cell)} has blanks around it, and would be another than {quoted(cell.strip())}"
            faults.add(DATA, line, name, f"{wrong}; remove them")


def _are_labels(cells: Sequence[str]) -> bool:
    """Return whether a column of whole numbers names things: few different ones that repeat."""
    values = set(cells)
    whole = all(re.fullmatch(r"[0-9]+\.?", cell) for cell in values)
    return whole and 2 <= len(values) <= min(MOST_LABELS, len(cells) / ROWS_A_LABEL)


def _are_words(cells: Sequence[str]) -> bool:
    """Return whether most cells are no numbers: one mistyped number does not make a column of words."""
    return sum(_is_number(cell) for cell in cells) < len(cells) / 2


def _is_number(cell: str) -> bool:
    try:
        # A percentage is a number to be refused as one, not a label.
        float(cell.removesuffix("%"))
    except ValueError:
        return False
    return True


def _unit(name: str) -> str:
    stem, _, suffix = name.rpartition("_")
    return SAME_UNIT.get(suffix, suffix) if stem and suffix in UNITS else ""
