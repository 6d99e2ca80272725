"""Recorded columns beyond the required ones: each name ends in a unit that is known."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from monitor.exceptions import did_you_mean
from monitor.readers.faults import Faults, quoted
from monitor.readers.tables.csv_table import CsvTable
from monitor.units import CONDITION_SUFFIXES, column_unit


def has_unit(column: str, suffixes: Sequence[str]) -> bool:
    """Return whether a name ends in one of the units: ``ambient_degC``."""
    return column_unit(column) is not None and column.rpartition("_")[2] in suffixes


def recorded_columns(
    table: CsvTable,
    taken: Sequence[str],
    faults: Faults,
    named: Collection[str] = (),
    suffixes: Sequence[str] = CONDITION_SUFFIXES,
    plain: Sequence[str] = (),
) -> list[str]:
    """Return the columns that are not ``taken``, in order; those of an unknown unit are noted and left out.

    Nothing more is noted of one that was ``named`` as the likely other name of a missing column: that is one mistake.
    ``suffixes`` are the units allowed, ``plain`` the columns without a unit that a method allows.
    """
    columns = []
    for column in table.columns:
        if column in taken or (column in named and not has_unit(column, suffixes)):
            continue
        if has_unit(column, suffixes) or column in plain:
            columns.append(column)
            continue
        ends = ", ".join(f"_{suffix}" for suffix in suffixes)
        hint = did_you_mean(column, [*taken, *plain]) or did_you_mean(column.rpartition("_")[2], suffixes)
        faults.add(
            table.file,
            1,
            column,
            f"the unit of {quoted(column)} is not known; {hint}end the name of a recorded column in {ends}",
        )
    return columns
