"""Writes tables as one workbook of Excel (Office Open XML): units in the headers, dates as dates, text as text."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from datetime import date, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from monitor import __version__
from monitor.exceptions import InputError, StoreError
from monitor.store.catalogue import check_machine
from monitor.store.connection import Database, utc_now
from monitor.store.copies.workbook_sheets import ComputedChange, Sheet, sheets
from monitor.store.past.simulated import simulated_campaigns

if TYPE_CHECKING:
    from openpyxl.worksheet._write_only import WriteOnlyWorksheet

#: What one sheet of a workbook holds (Excel specifications and limits).
MOST_ROWS, MOST_COLUMNS, LONGEST_TEXT = 1_048_576, 16_384, 32_767
#: Characters that XML 1.0 cannot hold.
_UNPRINTABLE = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f]")


def export_workbook(
    db: Database,
    path: Path,
    tables: Sequence[str] | None = None,
    machine: str | None = None,
    changes: Sequence[ComputedChange] = (),
) -> Path:
    """Write a workbook with a sheet a table, and one that says what the columns hold.

    ``changes`` are those of the sheet of that name that nobody recorded.

    Raises InputError where the file is there already, openpyxl is not installed or a table is too long for a sheet;
    NotFoundError for a table or machine that is not there, StoreError where it cannot be written.
    """
    check_workbook_path(path)
    from openpyxl import Workbook

    if machine is not None:
        check_machine(db, machine)
    workbook = Workbook(write_only=True)
    written = sheets(db, tables, machine, changes)
    for sheet in (*written, _about(db, written)):
        if len(sheet.rows) >= MOST_ROWS or len(sheet.columns) > MOST_COLUMNS:
            raise InputError(
                f"{sheet.name} has {len(sheet.rows)} rows and {len(sheet.columns)} columns, more than a sheet holds: "
                "choose --machine or other --tables, or --format csv"
            )
        _fill(workbook.create_sheet(sheet.name[:31]), sheet)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        workbook.save(path)
    except OSError as fault:
        raise StoreError(f"the workbook {path} could not be written: {fault}") from fault
    return path


def check_workbook_path(path: Path) -> None:
    """Raise InputError where no workbook can be written, because openpyxl is not installed or the file is there."""
    try:
        import openpyxl  # noqa: F401
    except ImportError as error:
        raise InputError(
            "workbooks need openpyxl: pip install 'machine-health-monitor[excel]'; --format csv needs nothing"
        ) from error
    if path.exists():
        raise InputError(f"{path} is there already and is not written over; name another file")


def _about(db: Database, written: tuple[Sheet, ...]) -> Sheet:
    """What the workbook was made from, and what each column holds."""
    rows: list[tuple[Any, ...]] = [
        ("database", Path(db.path).name, ""),
        ("written at / UTC", utc_now(), ""),
        ("software", f"machine-health-monitor {__version__}", ""),
        *(
            ("campaign", name, "simulated, nobody measured it")
            for names in simulated_campaigns(db).values()
            for name in names
        ),
    ]
    rows += [
        (sheet.name, column, meaning)
        for sheet in written
        for column, meaning in zip(sheet.columns, sheet.meanings, strict=True)
    ]
    return Sheet("about", ("sheet", "column", "meaning"), tuple(rows), ("", "", ""))


def _fill(page: WriteOnlyWorksheet, sheet: Sheet) -> None:
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.styles import Font
    from openpyxl.utils import get_column_letter

    page.freeze_panes = "A2"
    page.auto_filter.ref = f"A1:{get_column_letter(max(1, len(sheet.columns)))}{len(sheet.rows) + 1}"
    for index, column in enumerate(sheet.columns, start=1):
        page.column_dimensions[get_column_letter(index)].width = max(10, min(30, len(column) + 3))
    heads = [WriteOnlyCell(page, value=column) for column in sheet.columns]
    for head in heads:
        head.font = Font(bold=True)
    page.append(heads)
    for row in sheet.rows:
        cells = []
        for value in row:
            plain = _plain(value)
            cell = WriteOnlyCell(page, value=plain)
            if isinstance(plain, str):
                # A name that begins with = is a name, not a formula.
                cell.data_type = "s"
            elif isinstance(plain, datetime):
                cell.number_format = "yyyy-mm-dd hh:mm:ss"
            cells.append(cell)
        page.append(cells)


def _plain(value: Any) -> str | int | float | bool | datetime | date | None:
    """A value as a cell holds it: no NaN, no offset, no character that XML lacks."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, datetime):
        return value.replace(tzinfo=None)
    if value is None or isinstance(value, bool | int | date):
        return value
    text = ", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
    return _UNPRINTABLE.sub("\N{REPLACEMENT CHARACTER}", text)[:LONGEST_TEXT]
