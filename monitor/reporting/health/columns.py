"""Widths of the columns of a machine's table of parameters: known beforehand, so that no cell has to be laid out to
find them, which takes a sixth of the time of a page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from monitor.reporting.svg.letter_widths import BOLD, MILLIMETRES_A_POINT, in_mm

#: Letters of the cells and of their heads in points, as in ``health.css``; the padding of a cell in mm.
CELL_PT, HEAD_PT = 7.4, 8.0
_PADDING_MM = 2.4
#: What the pictures of the history and a few words a line leave of the page; a longer symbol is broken.
_ROOM_MM = 98.0


class Printed(Protocol):
    """A line of the table as far as its columns depend on it."""

    @property
    def name(self) -> str:
        """The symbol."""
        ...

    @property
    def estimate(self) -> str:
        """The estimate with its digits."""
        ...

    @property
    def expanded(self) -> str:
        """Its expanded uncertainty."""
        ...

    @property
    def tolerance(self) -> str:
        """The limit; empty where none is stated."""
        ...

    @property
    def unit(self) -> str:
        """The unit."""
        ...

    @property
    def out(self) -> str:
        """The probability to be beyond the limit; empty where none is stated."""
        ...


def column_widths(lines: Sequence[Printed]) -> tuple[float, ...]:
    """Widths in em of symbol, estimate, U, tolerance, unit and P(out); what is left is the parameter's in words.

    In em of the table's letters: on a screen they are larger.
    """
    numbers = {
        "Estimate": [line.estimate for line in lines],
        "U": [line.expanded for line in lines],
        "Tolerance": [line.tolerance for line in lines],
        "Unit": [line.unit for line in lines],
        "P(out)": [line.out for line in lines],
    }
    # Cells of an alarm are bold.
    widths = [
        max([BOLD * in_mm(head, HEAD_PT), *(BOLD * in_mm(text, CELL_PT) for text in texts)]) + _PADDING_MM
        for head, texts in numbers.items()
    ]
    longest = max([BOLD * in_mm("Symbol", HEAD_PT), *(BOLD * in_mm(line.name, CELL_PT) for line in lines)])
    symbol = min(longest + _PADDING_MM + 1.0, _ROOM_MM - sum(widths))
    return tuple(round(width / (HEAD_PT * MILLIMETRES_A_POINT), 2) for width in (symbol, *widths))
