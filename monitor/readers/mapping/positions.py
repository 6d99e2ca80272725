"""Where the axes stood, from a second file beside that of the instrument."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from monitor.readers.axes import Axis
from monitor.readers.export import Export
from monitor.readers.faults import one_of, quoted
from monitor.readers.mapping.column_source import ColumnSource
from monitor.readers.mapping.mapping_file import Entry
from monitor.readers.mapping.rows import TARGET
from monitor.readers.mapping.selection import matching


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
