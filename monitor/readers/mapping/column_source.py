"""Where the cells of a column come from: a column of the file, or the same in every row."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal

from monitor.readers.faults import quoted
from monitor.readers.foreign_units import foreign_unit, unit_names
from monitor.readers.toml_table import Table

#: A scale beyond this is a slip: a mile in micrometres.
_LARGEST_FACTOR = 2e9


@dataclass(frozen=True)
class ColumnSource:
    """Where the cells of a column come from: a ``column`` of the file, or a ``constant``.

    Numbers are carried from ``unit`` (None: the file states it), multiplied by ``scale`` and moved by ``shift``; a
    ``deviation`` is added to the travel of the axes.
    """

    column: str | None = None
    constant: str | None = None
    unit: str | None = None
    scale: Decimal = Decimal(1)
    shift: Decimal = Decimal(0)
    deviation: bool = False


def column_source(table: Table, name: str) -> ColumnSource | None:
    """Return the source under a key: a column's name, a number for every row, or a table; None where it is damaged."""
    value = table.data[name]
    if isinstance(value, dict):
        inner = table.table(name)
        return None if inner is None else _source(inner)
    if isinstance(value, str):
        column = table.text(name, example='"Position"')
        return None if column is None else ColumnSource(column)
    number = table.number(name, largest=1e9, unit="the unit of the column's name", example="0.0")
    return None if number is None else ColumnSource(constant=repr(number))


def _source(table: Table) -> ColumnSource | None:
    before = len(table.faults)
    column = table.text("column", required=True, example='"Position"')
    unit = table.text("unit", example='"mm"')
    if unit is not None and foreign_unit(unit) is None:
        table.fault("unit", f"{quoted(unit)} is no unit that is known; there are {unit_names()}")
    sign = table.sign("sign")
    factor = table.number("factor", largest=_LARGEST_FACTOR, unit="1", example="0.5")
    if factor == 0.0:
        table.fault("factor", "0 leaves nothing of the column; write the constant instead")
    offset = table.number("offset", largest=1e9, unit="the unit of the column's name", example="0.0")
    deviation = table.raw("deviation", required=False, example="true")
    if deviation is not None and not isinstance(deviation, bool):
        table.fault("deviation", f"{quoted(deviation)} is neither; write true or false")
    table.finish()
    if len(table.faults) > before:
        return None
    scale = Decimal(sign or 1) * Decimal(repr(1.0 if factor is None else factor))
    return ColumnSource(column, None, unit, scale, Decimal(repr(offset or 0.0)), bool(deviation))
