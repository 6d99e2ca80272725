"""Cells of a CSV column as numbers. Whole columns at once; cell by cell only where something is wrong."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
import numpy.typing as npt

from monitor.readers.faults import Faults, quoted
from monitor.readers.tables.csv_table import CsvTable
from monitor.readers.tables.packed_cells import CELLS_AT_ONCE

Mask = npt.NDArray[np.bool_]

#: Largest run, day or sequence number: what a 32-bit integer column holds.
LARGEST_WHOLE = 2**31 - 1
# What a decimal number is written with. The rest of Python's float syntax (nan, 1_000, other scripts' digits)
# needs other characters, so a column that keeps to these can be handed to float() as it is.
NUMBER_CHARACTERS = frozenset("0123456789+-.eE")
DIGITS = frozenset("0123456789")
# Dashes that word processors put in row of a minus.
TYPOGRAPHIC_MINUS = "\u2212\u2013\u2014\u2010\u2011\ufe63\uff0d"


@dataclass(frozen=True)
class Numbers:
    """A column of numbers, NaN (or -1 for whole numbers) where ``good`` is False or the cell is empty."""

    values: npt.NDArray[np.float64]
    good: Mask


@dataclass(frozen=True)
class Wholes:
    """A column of whole numbers from 0, -1 where ``good`` is False."""

    values: npt.NDArray[np.int64]
    good: Mask


def numbers(table: CsvTable, column: str, faults: Faults, *, may_be_empty: bool = False) -> Numbers:
    """Read the column as finite numbers; empty cells are NaN where they are allowed."""
    cells = table.columns[column]
    if _characters(cells) <= NUMBER_CHARACTERS:
        read = (float(cell) if cell else math.nan for cell in cells) if may_be_empty else map(float, cells)
        try:
            values = np.fromiter(read, dtype=np.float64, count=len(cells))
        except ValueError:
            pass
        else:
            if not np.isinf(values).any():
                return Numbers(values, np.ones(len(cells), dtype=np.bool_))
    return _numbers_one_by_one(table, column, cells, faults, may_be_empty)


def wholes(table: CsvTable, column: str, faults: Faults) -> Wholes:
    """Read the column as whole numbers from 0."""
    cells = table.columns[column]
    if cells and all(cells) and max(map(len, cells)) < 10 and _characters(cells) <= DIGITS:
        whole = np.fromiter(map(int, cells), dtype=np.int64, count=len(cells))
        return Wholes(whole, np.ones(len(cells), dtype=np.bool_))
    values = np.full(len(cells), -1, dtype=np.int64)
    for row, cell in enumerate(cells):
        if re.fullmatch(r"[0-9]{1,20}", cell) and int(cell) <= LARGEST_WHOLE:
            values[row] = int(cell)
        else:
            fault = "the cell is empty" if not cell else f"{quoted(cell)} is not a whole number"
            right = f"write digits only, from 0 to {LARGEST_WHOLE}"
            if re.match(r"[0-9]{4}-[0-9]{2}-[0-9]{2}", cell):
                fault, right = f"{quoted(cell)} is a date", "number them: 1 for the first, 2 for the next"
            faults.add(table.file, table.lines[row], column, f"{fault}; {right}")
    return Wholes(values, values >= 0)


def _characters(cells: Sequence[str]) -> set[str]:
    """Return what the cells are written with; the text of a part of them is put together at a time."""
    characters: set[str] = set()
    rest = iter(cells)
    for _ in range(0, len(cells), CELLS_AT_ONCE):
        characters.update("".join(islice(rest, CELLS_AT_ONCE)))
    return characters


def _numbers_one_by_one(
    table: CsvTable, column: str, cells: Sequence[str], faults: Faults, may_be_empty: bool
) -> Numbers:
    values = np.full(len(cells), math.nan)
    good = np.zeros(len(cells), dtype=np.bool_)
    for row, cell in enumerate(cells):
        if not cell and may_be_empty:
            good[row] = True
            continue
        wrong = what_is_wrong(cell)
        if wrong is None:
            values[row] = float(cell)
            good[row] = True
        else:
            faults.add(table.file, table.lines[row], column, wrong)
    return Numbers(values, good)


def what_is_wrong(cell: str) -> str | None:
    """Return why a cell is no finite decimal number, and what to write; None if it is one."""
    if not cell:
        return "the cell is empty; a number is needed"
    shown = quoted(cell)
    if set(cell) <= NUMBER_CHARACTERS:
        try:
            value = float(cell)
        except ValueError:
            return f"{shown} is not a number; write digits with a decimal point, such as -12.345"
        return None if math.isfinite(value) else f"{shown} is too large for a number; a finite one is needed"
    if cell.strip().lstrip("+-").lower() in ("nan", "inf", "infinity"):
        return f"{shown} is not a finite number; leave out the row, or measure again"
    if cell.endswith("%"):
        return (
            f"{shown} is a percentage: in a column whose name ends in _percent leave the % out; elsewhere write a "
            "plain number (in Excel: a number format without %)"
        )
    if cell != cell.strip():
        return f"{shown} is not a number: remove the spaces around it"
    if any(mark in cell for mark in TYPOGRAPHIC_MINUS):
        return f"{shown} is not a number: its minus is a typographic sign; write the plain '-'"
    if re.fullmatch(r"[+-]?[0-9]+,[0-9]+", cell):
        point = cell.replace(",", ".")[:40]
        return (
            f"{shown} is not a number: it has a decimal comma; write a decimal point, {point}, and no thousands "
            "separators"
        )
    if re.fullmatch(
        r"[+-]?[0-9]{1,3}([,'_ \u00a0\u2009\u202f\u2019][0-9]{3})+([.,][0-9]*)?", cell
    ) or re.fullmatch(r"[+-]?[0-9]{1,3}(\.[0-9]{3})+,[0-9]*", cell):
        return f"{shown} is not a number: write it without thousands separators"
    return f"{shown} is not a number; write digits with a decimal point, such as -12.345"
