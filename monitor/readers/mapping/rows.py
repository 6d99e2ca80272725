"""The cells of a campaign's columns from one file of an instrument, by what the mapping says of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal

import numpy as np

from monitor.readers.axes import Axis
from monitor.readers.export import Export
from monitor.readers.faults import Faults, one_of, quoted
from monitor.readers.foreign_units import (
    Conversion,
    ForeignUnit,
    as_angle,
    decimal_of,
    foreign_unit,
    has_full_parts,
    plain,
    unit_names,
    unit_of_column,
)
from monitor.readers.mapping.column_source import ColumnSource
from monitor.readers.mapping.dates import clock_seconds
from monitor.readers.mapping.mapping_file import Entry
from monitor.readers.mapping.pointing import DIRECTION, Pointing, beyond, in_words, too_low, vectors
from monitor.readers.mapping.selection import matching, no_column, selected, valid
from monitor.readers.mapping.travel import exchanged, travel
from monitor.readers.toml_table import Table
from monitor.records import Machine, Setup

TIME = "time_s"
TARGET = "target"
#: Digits of mm that a computed travel is written with: a picometre.
_DIGITS = 9


@dataclass(frozen=True)
class Wanted:
    """What the campaign asks of a row: the axes, the machine, the columns of its readings and those that may be empty.

    ``setup`` is None for methods whose rows belong to none, or where a column names it.
    """

    machine: Machine
    axes: tuple[Axis, ...]
    setup: Setup | None
    columns: tuple[str, ...]
    optional: tuple[str, ...]


@dataclass(frozen=True)
class Origin:
    """Where the cells of a column came from: its name in the file (None: a constant), its unit there, in words."""

    column: str | None
    unit: str | None
    how: str


@dataclass(frozen=True)
class Rows:
    """The rows (n) of one file: cells by campaign's column, the line of each, where each column came from.

    ``angles`` are what directions were computed from: shown to people, in no campaign. ``notes`` say what was left out.
    """

    cells: Mapping[str, Sequence[str]]
    lines: Sequence[int]
    origins: Mapping[str, Origin]
    angles: Mapping[str, Sequence[str]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.lines)


def rows_of(entry: Entry, file: str, export: Export, wanted: Wanted, faults: Faults) -> Rows | None:
    """Return the rows of a file; None where a column is missing, its unit unknown, or nothing is left."""
    before = len(faults)
    export = selected(entry, file, export)
    if not export.lines:
        return None
    sources = _sources(entry, file, export, wanted)
    export, notes = valid(entry, file, export, [*sources.values(), *entry.angles.values()])
    if not export.lines:
        return None
    cells: dict[str, Sequence[str]] = {}
    origins: dict[str, Origin] = {}
    first = [axis.column for axis in wanted.axes] + list(wanted.columns)
    for name, source in sorted(
        sources.items(), key=lambda pair: (pair[0] not in first, pair[0] in wanted.columns)
    ):
        filled = _filled(entry.table.section("columns"), file, export, name, source)
        if filled is not None:
            cells[name], origins[name] = filled
    pointed = None if entry.pointing is None else _pointed(entry, entry.pointing, file, export, wanted)
    if len(faults) > before:
        return None
    for name, source in sources.items():
        if source.deviation:
            summed = _with_travel(entry, name, cells, wanted)
            if summed is not None:
                notes += _exchanged(cells[name], summed)
                cells[name] = summed
                how = f"{origins[name].how}, added to the travel of the axes"
                origins[name] = replace(origins[name], how=how)
    if len(faults) > before:
        return None
    if pointed is None:
        return Rows(cells, export.lines, origins, notes=notes)
    return Rows(
        {**cells, **pointed.cells}, export.lines, {**origins, **pointed.origins}, pointed.angles, notes
    )


def _pointed(entry: Entry, pointing: Pointing, file: str, export: Export, wanted: Wanted) -> Rows | None:
    """Return the directions of a file of angles; None with the faults noted, of rows by their lines."""
    table = entry.table.section("direction")
    mapped = [name for name in DIRECTION if name in entry.columns]
    if wanted.setup is None or wanted.setup.reading != "direction":
        table.fault(None, 'angles of a line of sight belong to a setup with reading = "direction"')
        return None
    if mapped:
        table.fault(None, f"{mapped[0]} is computed from these angles; leave it out of [exports.columns]")
        return None
    sources = _angles(table, pointing, file, export)
    if sources is None:
        return None
    numbers = {name: np.array([float(cell) for cell in cells]) for name, (cells, _) in sources.items()}
    directions = vectors(pointing, numbers)
    for row in np.flatnonzero(too_low(pointing, directions)).tolist():
        table.faults.add(
            file, export.lines[row], sources[pointing.second][1].column,
            "lower than 10 degrees above the horizon, where refraction is not computed here; leave the row out, or map "
            'angles with it (refraction = "applied")',
        )  # fmt: skip
    origins = {name: Origin(None, None, in_words(pointing)) for name in DIRECTION}
    origins |= {name: origin for name, (_, origin) in sources.items()}
    written = [[f"{value:.12f}" for value in column] for column in directions.T.tolist()]
    angles = {name: cells for name, (cells, _) in sources.items()}
    return Rows(dict(zip(DIRECTION, written, strict=True)), export.lines, origins, angles)


def _angles(
    table: Table, pointing: Pointing, file: str, export: Export
) -> dict[str, tuple[Sequence[str], Origin]] | None:
    """Return the numbers of the angles and of the weather by name, and where they came from; None with faults noted."""
    before = len(table.faults)
    filled: dict[str, tuple[Sequence[str], Origin]] = {}
    for name, source in pointing.sources.items():
        column = _filled(table, file, export, name, source)
        if column is not None:
            _check(table, file, export.lines, (name, column[1]), column[0])
            filled[name] = column
    return None if len(table.faults) > before else filled


def _check(
    table: Table, file: str, lines: Sequence[int], named: tuple[str, Origin], cells: Sequence[str]
) -> None:
    """Note what no angle or weather can be, by line where it is a cell."""
    name, origin = named
    example = "; write 75.255 or 75:15:18.0, minutes and seconds below 60" if name.endswith("_deg") else ""
    for line, cell in zip(lines, cells, strict=True):
        number = decimal_of(cell)
        fault = (
            f"{quoted(cell)} {_what_is_wrong(cell)}{example}"
            if number is None
            else beyond(name, float(number))
        )
        if fault is None:
            continue
        if origin.column is None:
            table.fault(name, fault)
            break
        table.faults.add(file, line, f"{origin.column} ({name})", fault)


def _what_is_wrong(cell: str) -> str:
    """Why a cell is no angle and no weather, in words that follow it."""
    return "has minutes or seconds that are not below 60" if has_full_parts(cell) else "is no finite number"


def _sources(entry: Entry, file: str, export: Export, wanted: Wanted) -> dict[str, ColumnSource]:
    """Return the source of every column: as mapped, or the column of the file that goes by the same name."""
    sources = dict(entry.columns)
    asked = [axis.column for axis in wanted.axes] + list(wanted.columns)
    # What was mapped to another column is not taken a second time: the x of a tracker is no reading of the axis X.
    taken = {matching(export, source.column or "") for source in (*sources.values(), *entry.angles.values())}
    for name in [*asked, TIME, TARGET]:
        if name in sources:
            continue
        column = matching(export, name) or matching(export, name.rpartition("_")[0] or name)
        if column in taken:
            column = None
        if column is not None:
            sources[name] = ColumnSource(column)
        elif name in asked and name not in wanted.optional:
            constant = (
                f", or {name} = 0.0 where it did not move" if name.rpartition("_")[2] in ("mm", "deg") else ""
            )
            entry.table.fault(
                "columns",
                f'nothing says which column of {file} is {name}; write {name} = "COLUMN"{constant}; the file has '
                f"{one_of(export.columns)}",
            )
    return sources


def _filled(
    table: Table, file: str, export: Export, name: str, source: ColumnSource
) -> tuple[Sequence[str], Origin] | None:
    """Return the cells of one column in its unit, and where they came from; None with the fault noted in ``table``."""
    if source.constant is not None:
        return [source.constant] * len(export.lines), Origin(None, None, "the same in every row")
    column = matching(export, source.column or "")
    if column is None:
        table.fault(name, no_column(file, source.column or "", export))
        return None
    cells = export.columns[column]
    target = unit_of_column(name)
    if target is None:
        if source.unit is not None:
            table.fault(name, f"{name} has no unit; leave unit out")
            return None
        return cells, Origin(column, None, f"column {column}")
    if name == TIME and column not in export.units and (seconds := clock_seconds(cells)) is not None:
        return seconds, Origin(column, None, f"column {column}, seconds from the first")
    unit = _unit_in_file(table, file, export, name, replace(source, column=column), target)
    if unit is None:
        return None
    conversion = Conversion(unit, target, source.scale, source.shift)
    how = f"column {column} in {unit.name}" + ("" if column in export.units else " (by the mapping)")
    if source.scale != 1:
        how += f", times {plain(source.scale)}"
    if source.shift:
        how += f", plus {plain(source.shift)} {target.name}"
    return [conversion.cell(cell) for cell in cells], Origin(column, unit.name, how)


def _unit_in_file(
    table: Table, file: str, export: Export, name: str, source: ColumnSource, target: ForeignUnit
) -> ForeignUnit | None:
    """Return the unit of a column of a file; None with the fault noted where nobody or two different ones state it."""
    column = source.column or ""
    stated = export.units.get(column)
    unit = _of_quantity(foreign_unit(stated or source.unit or ""), target)
    if unit is None:
        table.fault(
            name,
            f"nothing states the unit of column {quoted(column)} of {file}; write {name} = {{ column = "
            f'"{column}", unit = "{target.name}" }}, with the unit that the instrument used',
        )
        return None
    if (
        stated is not None
        and source.unit is not None
        and _of_quantity(foreign_unit(source.unit), target) != unit
    ):
        table.fault(
            name,
            f"{file} states {stated} for column {quoted(column)}, the mapping says {source.unit}; leave unit out here "
            "where the file is right, or correct the export",
        )
        return None
    if unit.quantity != target.quantity:
        table.fault(
            name,
            f"column {quoted(column)} of {file} is in {unit.name}, which is no {target.quantity}; {name} takes "
            f"{unit_names(target.quantity)}",
        )
        return None
    return unit


def _of_quantity(unit: ForeignUnit | None, target: ForeignUnit) -> ForeignUnit | None:
    """Return a unit, hours of a column of angles as hours of angle."""
    return as_angle(unit) if unit is not None and target.quantity == "angle" else unit


def _with_travel(
    entry: Entry, name: str, cells: Mapping[str, Sequence[str]], wanted: Wanted
) -> Sequence[str] | None:
    """Return deviations added to the travel of the axes along the setup's direction, as ``displacement`` has them."""
    table = entry.table.section("columns")
    direction = None if wanted.setup is None else wanted.setup.direction
    if direction is None or wanted.setup is None or wanted.setup.reading != "displacement":
        table.fault(name, "deviation = true is for a setup of displacement; its reading is the whole travel")
        return None
    readings = {
        axis.name: numbers
        for axis in wanted.axes
        if (numbers := _numbers(cells.get(axis.column, ()))) is not None
    }
    missing = [axis.column for axis in wanted.axes if axis.name not in readings]
    if missing:
        # What is no number there is refused by its line when the rows are read.
        return cells[name]
    turned = [axis.column for axis in wanted.axes if axis.kind != "linear" and np.any(readings[axis.name])]
    if turned:
        table.fault(
            name,
            f"{turned[0]} is not zero, and the travel is known only with all rotary axes at zero; map the whole travel",
        )
        return None
    along, sense = travel(
        wanted.machine,
        direction,
        {axis.name: readings[axis.name] for axis in wanted.axes if axis.kind == "linear"},
    )
    if sense == 0.0:
        table.fault(
            name, "no axis moves along the direction of the setup; correct direction, or which axis moves"
        )
        return None
    return [
        cell if (number := decimal_of(cell)) is None
        else plain(number * Decimal(int(sense)) + 1000 * Decimal(repr(round(float(value), _DIGITS))))
        for cell, value in zip(cells[name], along, strict=True)
    ]  # fmt: skip


def _exchanged(deviations: Sequence[str], whole: Sequence[str]) -> tuple[str, ...]:
    """Return a sentence where deviations in µm are too large for the travel in µm with which they were summed."""
    errors, ways = _numbers(deviations), _numbers(whole)
    note = None if errors is None or ways is None else exchanged(errors, 1e-3 * (ways - errors))
    return () if note is None else (note,)


def _numbers(cells: Sequence[str]) -> np.ndarray | None:
    numbers = [decimal_of(cell) for cell in cells]
    return (
        np.array([float(number) for number in numbers if number is not None])
        if None not in numbers and cells
        else None
    )
