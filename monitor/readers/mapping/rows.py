"""The cells of a campaign's columns from one file of an instrument, by what the mapping says of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal

import numpy as np

from monitor.exceptions import did_you_mean
from monitor.readers.axes import Axis
from monitor.readers.delimited import name_and_unit
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
from monitor.readers.mapping.mapping_file import Entry
from monitor.readers.mapping.pointing import DIRECTION, Pointing, beyond, in_words, too_low, vectors
from monitor.readers.mapping.travel import travel
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

    ``angles`` are what directions were computed from: shown to people, in no campaign.
    """

    cells: Mapping[str, Sequence[str]]
    lines: Sequence[int]
    origins: Mapping[str, Origin]
    angles: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.lines)


def rows_of(entry: Entry, file: str, export: Export, wanted: Wanted, faults: Faults) -> Rows | None:
    """Return the rows of a file; None where a column is missing, its unit unknown, or nothing is left."""
    before = len(faults)
    export = _selected(entry, file, export)
    if not export.lines:
        return None
    sources = _sources(entry, file, export, wanted)
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
                cells[name] = summed
                how = f"{origins[name].how}, added to the travel of the axes"
                origins[name] = replace(origins[name], how=how)
    if len(faults) > before:
        return None
    if pointed is None:
        return Rows(cells, export.lines, origins)
    return Rows({**cells, **pointed.cells}, export.lines, {**origins, **pointed.origins}, pointed.angles)


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


def matching(export: Export, name: str) -> str | None:
    """Return the column of a file that goes by a name, capitals aside; None where there is none.

    A name may be the whole header with the unit that it states: ``Position [mm]`` is the column Position in mm.
    """
    folded = {column.casefold(): column for column in export.columns}
    column = name if name in export.columns else folded.get(name.casefold())
    if column is not None:
        return column
    stem, unit = name_and_unit(name)
    column = folded.get(stem.casefold())
    return column if column is not None and unit is not None and export.units.get(column) == unit else None


def _selected(entry: Entry, file: str, export: Export) -> Export:
    """Return the export with the rows that ``where`` asks for."""
    keep = np.ones(len(export.lines), dtype=np.bool_)
    table = entry.table.section("where")
    for name, text in entry.where.items():
        column = matching(export, name)
        if column is None:
            table.fault(name, _no_column(file, name, export))
            return export
        keep &= np.array([cell.casefold() == text.casefold() for cell in export.columns[column]])
        if not keep.any():
            others = one_of(list(dict.fromkeys(export.columns[column]))[:8])
            table.fault(name, f"no row of {file} has {quoted(text)} there; it has {others}")
            return replace(export, lines=())
    if keep.all():
        return export
    rows = np.flatnonzero(keep).tolist()
    columns = {name: [cells[row] for row in rows] for name, cells in export.columns.items()}
    return replace(export, columns=columns, lines=[export.lines[row] for row in rows])


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
        table.fault(name, _no_column(file, source.column or "", export))
        return None
    cells = export.columns[column]
    target = unit_of_column(name)
    if target is None:
        if source.unit is not None:
            table.fault(name, f"{name} has no unit; leave unit out")
            return None
        return cells, Origin(column, None, f"column {column}")
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


def _numbers(cells: Sequence[str]) -> np.ndarray | None:
    numbers = [decimal_of(cell) for cell in cells]
    return (
        np.array([float(number) for number in numbers if number is not None])
        if None not in numbers and cells
        else None
    )


def _no_column(file: str, name: str, export: Export) -> str:
    return f"{file} has no column {quoted(name)}; {did_you_mean(name, export.columns)}it has {one_of(export.columns)}"


def joined(
    entry: Entry, file: str, export: Export, positions_file: str, positions: Export, axes: Sequence[Axis]
) -> Export | None:
    """Return an export with the columns of a file that says where the axes stood; None with the fault noted.

    Rows are matched by ``target`` where both have it, else by their order. Its columns of axes go by the names that a
    campaign has for them (``x_mm``), beside columns of the export that may be called X too.
    """
    rows = _row_of_each(entry, file, export, positions_file, positions)
    if rows is None:
        return None
    further: dict[str, Sequence[str]] = {}
    units: dict[str, str] = {}
    for axis in axes:
        column = matching(positions, axis.column) or matching(positions, axis.name)
        if column is not None:
            further[axis.column] = [positions.columns[column][row] for row in rows]
            if column in positions.units:
                units[axis.column] = positions.units[column]
    if not further:
        expected = one_of(axis.column for axis in axes)
        entry.table.fault(
            "positions", f"{positions_file} has no column of an axis; name its columns {expected}"
        )
        return None
    return replace(export, columns={**export.columns, **further}, units={**export.units, **units})


def _row_of_each(
    entry: Entry, file: str, export: Export, positions_file: str, positions: Export
) -> list[int] | None:
    """Return the row of the positions that belongs to each row of an export; None with the fault noted."""
    ours = entry.columns.get(TARGET, ColumnSource(TARGET))
    name = matching(export, ours.column or "")
    key = matching(positions, TARGET)
    if name is not None and key is not None:
        index = {cell: row for row, cell in enumerate(positions.columns[key])}
        if len(index) < len(positions.lines):
            entry.table.fault("positions", f"{positions_file} names a target twice; list each once")
            return None
        lacking = [cell for cell in dict.fromkeys(export.columns[name]) if cell not in index]
        if lacking:
            entry.table.fault(
                "positions", f"{positions_file} has no row of {one_of(map(quoted, lacking[:5]))} of {file}"
            )
            return None
        return [index[cell] for cell in export.columns[name]]
    if len(positions.lines) == len(export.lines):
        return list(range(len(export.lines)))
    entry.table.fault(
        "positions",
        f"{positions_file} has {len(positions.lines)} rows and {file} {len(export.lines)}; give one row for "
        "each, or a column target in both",
    )
    return None
