"""Sheets of workbooks of Excel (.xlsx) as rows of text, as CSV would write what Excel shows."""

from __future__ import annotations

import io
import re
import warnings
import zipfile
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any

from monitor.exceptions import Fault
from monitor.readers.faults import Faults

#: Unpacked, a workbook of a million rows has some 200 MiB; what is larger is an attack on memory.
UNPACKED_BYTES = 512 * 2**20
#: What zipfile raises for a file that is no archive, or a damaged one.
UNREADABLE = (zipfile.BadZipFile, zlib.error, KeyError, ValueError, OSError, SyntaxError)
#: The first bytes of a compound file ([MS-CFB], 2.2): a workbook of Excel 97 (.xls), or an encrypted one.
_COMPOUND = b"\xd0\xcf\x11\xe0"
#: Number formats of Excel's own that show percent (ECMA-376-1:2016, 18.8.30), and those that a workbook adds.
_PERCENT_STYLE = re.compile(rb'numFmtId="(9|10)"|formatCode="[^"]*%')
#: What a number format writes as it stands, and is no sign of it.
_LITERAL = re.compile(r'"[^"]*"|\\.')
#: What the head of a column of percent says.
_OF_PERCENT = re.compile(r"%|percent\b|prozent\b", re.IGNORECASE)
NO_RESULT = "the cell holds a formula without a stored result; open the workbook in Excel and save it there"


@dataclass(frozen=True)
class Sheet:
    """The rows of a sheet as text, its name, and those of all sheets of its workbook."""

    name: str
    rows: list[list[str]]
    names: tuple[str, ...]


def read_sheet(
    file: str, content: bytes, sheet: str | None, faults: Faults, *, or_first: bool = False
) -> Sheet | None:
    """Return a sheet, the first one where none is named (``or_first``: or none has that name); None with the fault
    noted.

    A number whose format shows percent is what Excel shows where the head of its column says percent ("45"), and has
    its sign elsewhere ("45%"), which no column of numbers takes.
    """
    try:
        import openpyxl  # noqa: F401
    except ImportError:
        faults.add(
            file, None, None,
            "workbooks need openpyxl: pip install 'machine-health-monitor[excel]', or save the table as CSV",
        )  # fmt: skip
        return None
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as packed:
            if sum(member.file_size for member in packed.infolist()) > UNPACKED_BYTES:
                faults.add(
                    file,
                    None,
                    None,
                    f"the workbook unpacks to more than {UNPACKED_BYTES // 2**20} MiB; split it",
                )
                return None
            with_percent, with_formulas = _has_percent(packed), _has_formulas(packed)
        book = _opened(content, results=True)
        names = tuple(book.sheetnames)
    except Exception:  # a damaged workbook breaks its reader in as many ways as there are bytes
        _note_no_workbook(file, content, faults)
        return None
    title = _title(file, names, sheet, faults, or_first=or_first)
    if title is None:
        return None
    try:
        with warnings.catch_warnings():
            # Sheets are parsed as they are read. A moment of no calendar is then a cell with an error, and refused.
            warnings.simplefilter("ignore")
            rows = _rows_with_percent(book[title]) if with_percent else _rows(book[title])
            if with_formulas and _note_formulas(file, content, title, rows, faults):
                return None
    except Exception:  # a damaged sheet of a workbook that is whole elsewhere
        _note_no_workbook(file, content, faults)
        return None
    return Sheet(title, rows, names)


def _opened(content: bytes, *, results: bool) -> Any:
    from openpyxl import load_workbook

    with warnings.catch_warnings():
        # What openpyxl does not keep (drop-down lists, colours) is not read either.
        warnings.simplefilter("ignore")
        return load_workbook(io.BytesIO(content), read_only=True, data_only=results)


def _title(
    file: str, titles: Sequence[str], sheet: str | None, faults: Faults, *, or_first: bool
) -> str | None:
    """Return the name of the sheet as it stands in the workbook, whatever blanks are around it."""
    first = titles[0] if titles else None
    named = {title.strip().casefold(): title for title in titles}
    title = first if sheet is None else named.get(sheet.strip().casefold(), first if or_first else None)
    if title is None:
        faults.add(
            file, None, None,
            f"there is no sheet '{sheet}'; name the sheet of that table so; there are {listed(titles)}",
        )  # fmt: skip
    return title


def listed(titles: Iterable[str]) -> str:
    """Return names of sheets in quotes, so that blanks and commas in them are seen."""
    return ", ".join(f"'{title}'" for title in titles)


def _has_percent(packed: zipfile.ZipFile) -> bool:
    return "xl/styles.xml" in packed.namelist() and bool(_PERCENT_STYLE.search(packed.read("xl/styles.xml")))


def _has_formulas(packed: zipfile.ZipFile) -> bool:
    sheets = [
        name for name in packed.namelist() if name.startswith("xl/worksheets/") and name.endswith(".xml")
    ]
    return any(re.search(rb"<f[ >/]", packed.read(name)) for name in sheets)


def _rows(sheet: Any) -> list[list[str]]:
    return [[_text(value) for value in row] for row in sheet.iter_rows(values_only=True)]


def _rows_with_percent(sheet: Any) -> list[list[str]]:
    of_percent: set[int] = set()
    rows = []
    for row in sheet.iter_rows():
        texts = []
        for index, cell in enumerate(row):
            value = cell.value
            if isinstance(value, str) and _OF_PERCENT.search(value):
                of_percent.add(index)
            is_number = isinstance(value, int | float) and not isinstance(value, bool)
            if is_number and "%" in _LITERAL.sub("", cell.number_format or ""):
                shown = _text(float(f"{100 * value:.15g}"))
                texts.append(shown if index in of_percent else f"{shown}%")
            else:
                texts.append(_text(value))
        rows.append(texts)
    return rows


def _note_formulas(file: str, content: bytes, title: str, rows: list[list[str]], faults: Faults) -> bool:
    """Note the formulas whose results the workbook does not hold; return whether there are any."""
    width = max((index + 1 for index, cell in enumerate(rows[0] if rows else []) if cell), default=0)
    if all(all(row[:width]) for row in rows):
        return False
    formulas = _opened(content, results=False)[title].iter_rows(values_only=True)
    lacking = []
    for line, (row, written) in enumerate(zip(rows, formulas, strict=False), start=1):
        for index, (text, value) in enumerate(zip(row, written, strict=False)):
            # openpyxl has formulas as text or, of arrays, as objects of its own.
            if not text and value is not None and _text(value):
                lacking.append(Fault(file, line, rows[0][index] if index < width else None, NO_RESULT, title))
    faults.extend(lacking)
    return bool(lacking)


def _note_no_workbook(file: str, content: bytes, faults: Faults) -> None:
    if content.startswith(_COMPOUND):
        why = "it is one of Excel 97 (.xls) or has a password; save it in Excel as .xlsx without a password"
    elif content.startswith(b"PK"):
        why = "it is damaged or was cut off; copy it again, or save it anew"
    else:
        why = "it is of another kind, whatever its name says; save it in Excel as .xlsx, or name a table in text .csv"
    faults.add(file, None, None, f"this is no workbook of Excel (.xlsx) that can be read: {why}")


def _text(value: Any) -> str:
    """A cell as CSV writes it: decimal points, true and false, moments in ISO 8601."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    if isinstance(value, datetime | date):
        return value.isoformat()
    return " ".join(str(value).splitlines())
