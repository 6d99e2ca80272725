"""``mapping.toml``: what ``campaign.toml`` has, and for each file of an instrument what its columns are.

Everything but ``[[exports]]``, ``[[runs]]`` and ``[dates]`` is as in ``campaign.toml``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from monitor.exceptions import did_you_mean
from monitor.readers.export import ExportFormat
from monitor.readers.faults import one_of, quoted
from monitor.readers.mapping.column_source import ColumnSource, column_source
from monitor.readers.mapping.dates import ORDERS, Dates
from monitor.readers.mapping.pointing import Pointing, read_pointing
from monitor.readers.registry import export_formats
from monitor.readers.toml_table import Table

FILE = "mapping.toml"
#: The key that says which statements of a file's head are wrong, and what it may name.
OVERRULED, STATED = "overruled", ("axis", "kind", "plane", "radius", "points")
_OFFSET = re.compile(r"[+-][0-9]{2}:[0-9]{2}|Z")
#: Columns that this reader numbers itself.
_NUMBERED = ("run", "sequence")


@dataclass(frozen=True)
class Entry:
    """One ``[[exports]]``: the files that ``pattern`` names, their format, and the source of each campaign's column.

    ``pointing`` has the columns of angles that say where a line of sight pointed, None where no angles are mapped;
    ``where`` keeps the rows whose cells are those texts; ``positions`` is a file that says where the axes stood;
    ``interval`` (s) is the time from row to row where no column has it; an ``optional`` entry may have no file;
    ``overruled`` is what the head of the file says wrongly, such as axis.
    ``table`` is for faults.
    """

    table: Table
    pattern: str
    format: ExportFormat
    settings: Any
    setup: str | None
    run: int
    columns: Mapping[str, ColumnSource]
    pointing: Pointing | None
    where: Mapping[str, str]
    positions: str | None
    interval: float
    optional: bool
    overruled: tuple[str, ...] = ()

    @property
    def angles(self) -> Mapping[str, ColumnSource]:
        """The sources of the angles and the weather from which directions are computed; none where no angles are."""
        return {} if self.pointing is None else self.pointing.sources


@dataclass(frozen=True)
class ExportMapping:
    """What the tables say that ``campaign.toml`` does not have; ``runs`` are the tables [[runs]]."""

    entries: tuple[Entry, ...]
    runs: tuple[Table, ...]
    dates: Dates


def read_mapping(top: Table) -> ExportMapping:
    """Read the exports, the runs and how dates are written; what is wrong is noted."""
    entries = [entry for row in top.tables("exports") if (entry := _entry(row)) is not None]
    if "exports" not in top.data:
        top.fault("exports", "the tables [[exports]] are missing: one for each file of an instrument")
    return ExportMapping(tuple(entries), tuple(top.tables("runs")), _dates(top.table("dates")))


def _entry(table: Table) -> Entry | None:
    before = len(table.faults)
    pattern = table.text("file", required=True, example='"laser-x*.rtl"')
    form = _format(table, pattern)
    setup = table.text("setup", example='"laser-x"')
    run = table.raw("run", required=False, example="1")
    if run is not None and (type(run) is not int or run < 0):
        table.fault("run", f"{quoted(run)} is no run; write a whole number such as 1")
    interval = table.number("interval_s", positive=True, largest=1e6, unit="s", example="1.0")
    positions = table.text("positions", example='"positions.csv"')
    optional = table.raw("optional", required=False, example="true")
    if optional is not None and not isinstance(optional, bool):
        table.fault("optional", f"{quoted(optional)} is neither; write true or false")
    overruled = _overruled(table)
    columns = _columns(table.table("columns"))
    pointing = read_pointing(table.table("direction"))
    where = _where(table.table("where"))
    settings = None if form is None else form.settings(table)
    table.finish()
    if len(table.faults) > before or pattern is None or form is None:
        return None
    defaults = {name: ColumnSource(column) for name, column in form.columns.items() if name not in columns}
    return Entry(
        table, pattern, form, settings, setup, 1 if run is None else run, {**defaults, **columns}, pointing, where,
        positions, interval or 1.0, bool(optional), overruled,
    )  # fmt: skip


def _overruled(table: Table) -> tuple[str, ...]:
    """Return what the mapping says that the head of the file is wrong in."""
    overruled = table.raw(OVERRULED, required=False, example='["axis"]')
    if overruled is None:
        return ()
    if not isinstance(overruled, list) or any(word not in STATED for word in overruled):
        table.fault(
            OVERRULED, f'{quoted(overruled)} is no list of {one_of(STATED)}; write for example ["axis"]'
        )
        return ()
    return tuple(overruled)


def _format(table: Table, pattern: str | None) -> ExportFormat | None:
    """Return the format that the mapping names, or the one whose files end so; None with the fault noted."""
    formats = export_formats()
    name = table.text("format", example='"table"')
    if name is not None and name not in formats:
        table.fault(
            "format",
            f"{quoted(name)} is no format; {did_you_mean(name, formats)}the formats are {one_of(formats)}",
        )
        return None
    if name is not None:
        return formats[name]
    if "format" in table.data or pattern is None:
        return None
    ending = pattern.casefold()
    by_suffix = [form for form in formats.values() if any(ending.endswith(end) for end in form.suffixes)]
    if not by_suffix:
        table.fault(
            "file", f"the end of {quoted(pattern)} says no format; write format = one of {one_of(formats)}"
        )
        return None
    return by_suffix[0]


def _columns(table: Table | None) -> dict[str, ColumnSource]:
    """Return the source of each column that the mapping names."""
    if table is None:
        return {}
    sources: dict[str, ColumnSource] = {}
    for name in table.data:
        if name in _NUMBERED:
            table.raw(name, required=False, example="")
            table.fault(
                name, "rows and runs are numbered here; write run = 2 beside file, and leave this out"
            )
        elif (source := column_source(table, name)) is not None:
            sources[name] = source
    table.finish()
    return sources


def _where(table: Table | None) -> dict[str, str]:
    if table is None:
        return {}
    texts = {name: text for name in table.data if (text := table.text(name, example='"CW"')) is not None}
    table.finish()
    return texts


def _dates(table: Table | None) -> Dates:
    if table is None:
        return Dates()
    order = table.text("order", example='"day-month-year"')
    if order is not None and order not in ORDERS:
        table.fault("order", f"{quoted(order)} is no order; write one of {one_of(ORDERS)}")
        order = None
    offset = table.text("utc_offset", example='"+01:00"')
    if offset is not None and (not _OFFSET.fullmatch(offset) or not _is_offset(offset)):
        table.fault("utc_offset", f"{quoted(offset)} is no offset from UTC; write for example '+01:00'")
        offset = None
    table.finish()
    return Dates(order, offset)


def _is_offset(offset: str) -> bool:
    try:
        datetime.fromisoformat(f"2026-01-01T00:00:00{offset}")
    except ValueError:
        return False
    return True
