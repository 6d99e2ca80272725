"""The columns of a file by the names that the mapping has for them, and the rows of it that count."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from monitor.exceptions import did_you_mean
from monitor.readers.export import Export
from monitor.readers.faults import one_of, quoted
from monitor.readers.mapping.column_source import ColumnSource
from monitor.readers.mapping.mapping_file import Entry
from monitor.readers.tables.delimited import name_and_unit


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


def selected(entry: Entry, file: str, export: Export) -> Export:
    """Return the export with the rows that ``where`` asks for."""
    keep = np.ones(len(export.lines), dtype=np.bool_)
    table = entry.table.section("where")
    for name, text in entry.where.items():
        column = matching(export, name)
        if column is None:
            table.fault(name, no_column(file, name, export))
            return export
        keep &= np.array([cell.casefold() == text.casefold() for cell in export.columns[column]])
        if not keep.any():
            others = one_of(list(dict.fromkeys(export.columns[column]))[:8])
            table.fault(name, f"no row of {file} has {quoted(text)} there; it has {others}")
            return replace(export, lines=())
    return export if keep.all() else _with_rows(export, np.flatnonzero(keep).tolist())


def _with_rows(export: Export, rows: Sequence[int]) -> Export:
    """Return an export with some of its rows."""
    columns = {name: [cells[row] for row in rows] for name, cells in export.columns.items()}
    invalid = {
        name: {new: marks[old] for new, old in enumerate(rows) if old in marks}
        for name, marks in export.invalid.items()
    }
    return replace(export, columns=columns, lines=[export.lines[row] for row in rows], invalid=invalid)


def valid(
    entry: Entry, file: str, export: Export, sources: Sequence[ColumnSource]
) -> tuple[Export, tuple[str, ...]]:
    """Return the export without rows of which the file marks a mapped cell invalid, and a sentence on these."""
    columns = [column for source in sources if (column := matching(export, source.column or "")) is not None]
    marks: dict[int, str] = {}
    for column in dict.fromkeys(columns):
        for row, why in export.invalid.get(column, {}).items():
            marks.setdefault(row, f"{column} on line {export.lines[row]} ({why})")
    if not marks:
        return export, ()
    valid_rows = [row for row in range(len(export.lines)) if row not in marks]
    shown = [marks[row] for row in sorted(marks)]
    listed = ", ".join(shown[:5]) + (", ..." if len(shown) > 5 else "")
    if not valid_rows:
        entry.table.faults.add(
            file, export.lines[0], None, f"the file marks every row invalid: {listed}; measure them again"
        )
    note = f"{len(shown)} of {len(export.lines)} rows are left out, which the file marks invalid: {listed}"
    return _with_rows(export, valid_rows), (note,)


def no_column(file: str, name: str, export: Export) -> str:
    """Return what is said of a column that a file has not, or has several times."""
    alike = [column for column in export.columns if column.casefold().startswith(f"{name.casefold()} ")]
    if len(alike) > 1:
        return f"{file} has several columns {quoted(name)}; write which, by its name: {one_of(map(quoted, alike))}"
    return f"{file} has no column {quoted(name)}; {did_you_mean(name, export.columns)}it has {one_of(export.columns)}"
