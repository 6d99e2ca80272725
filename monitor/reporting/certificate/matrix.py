"""The correlation matrix on paper: its lower triangle in blocks that fit a page, one line of text a row.

A line is one piece of text whose columns are spaces apart, and the greys behind a block are one drawing: as a table
with a cell for every coefficient, the 11 000 of 149 parameters took twelve times as long.
"""

from __future__ import annotations

from dataclasses import dataclass

from markupsafe import Markup

from monitor.records import Array
from monitor.reporting.numbers import MINUS, written_correlation
from monitor.reporting.palette import PAGE_WIDTH_MM
from monitor.reporting.svg.letter_widths import MILLIMETRES_A_POINT, in_mm, in_units, units_an_em
from monitor.reporting.svg.plot import SCALE, Drawing
from monitor.reporting.texts import Texts

#: Rows of one block: 82 lines of 2.6 mm and the columns' names are less than a page.
ROWS = 82
#: Size of the letters in points, and height of a line. The style sheet has the same.
_POINTS, LINE_MM = 6.2, 2.6
#: Width of a column where names stand above it, and where numbers do.
_NAMED_MM, _NUMBERED_MM = 10.2, 9.2
#: A name longer than this does not fit above its column: columns are numbered then.
_LONGEST_ABOVE_MM = 9.6
#: The names at the left take no more than this; a longer one is cut, its number and the table of results tell it.
_MOST_LEFT_MM = 84.0
#: The darkest of so many greys behind a coefficient: dark letters stay readable on it (contrast above 7).
_DARKEST, _GREYS = 0.38, 8
#: Spaces of Unicode, the widest first; all but the last are in every text font.
_SPACES = ("\N{EM SPACE}", "\N{FIGURE SPACE}", "\N{PUNCTUATION SPACE}", "\N{THIN SPACE}", "\N{HAIR SPACE}")


@dataclass(frozen=True)
class Block:
    """A part of the matrix as printed: the ``head`` with the columns, ``lines`` of text, ``shades`` behind them.

    Lines and head begin with the name of the row, and go on at a tab stop ``left_mm`` from the left.
    """

    head: str
    lines: tuple[str, ...]
    left_mm: float
    shades: Markup
    title: str


def correlation_blocks(
    names: tuple[str, ...], correlation: Array, texts: Texts, title: str
) -> tuple[Block, ...]:
    """The lower triangle in blocks of columns and of rows; rows wholly above the diagonal are left out."""
    numbered = max((in_mm(column, _POINTS) for column in names), default=0.0) > _LONGEST_ABOVE_MM
    heads = tuple(str(index + 1) for index in range(len(names))) if numbered else names
    sides = tuple(_side(name, index) for index, name in enumerate(names)) if numbered else names
    pitch = _NUMBERED_MM if numbered else _NAMED_MM
    left_mm = max((in_mm(column, _POINTS) for column in sides), default=0.0) + 2.0
    across = max(1, int((PAGE_WIDTH_MM - left_mm) / pitch))
    blocks = []
    for start in range(0, len(names), across):
        columns = range(start, min(start + across, len(names)))
        count = len(names) - start
        parts = -(-count // ROWS)
        each = -(-count // parts)
        for first in range(start, len(names), each):
            rows = range(first, min(first + each, len(names)))
            coefficients = [
                [float(correlation[row, column]) for column in columns if column <= row] for row in rows
            ]
            blocks.append(
                Block(
                    head="\t" + _spaced([heads[column] for column in columns], pitch, middle=True),
                    lines=tuple(
                        f"{sides[row]}\t"
                        + _spaced([_signed(column, texts.decimal_sign) for column in values], pitch)
                        for row, values in zip(rows, coefficients, strict=True)
                    ),
                    left_mm=left_mm,
                    shades=_shades(coefficients, pitch, title),
                    title=title,
                )
            )
    return tuple(blocks)


def _side(name: str, index: int) -> str:
    number = f" ({index + 1})"
    while in_mm(name + number, _POINTS) > _MOST_LEFT_MM:
        name = name.rstrip("…")[:-1] + "…"
    return name + number


def _signed(coefficient: float, decimal_sign: str) -> str:
    """A coefficient with room for a sign, so that digits stand below digits."""
    written = written_correlation(coefficient, decimal_sign)
    return written if written.startswith(MINUS) else "\N{FIGURE SPACE}\N{THIN SPACE}" + written


def _spaced(entries: list[str], pitch: float, *, middle: bool = False) -> str:
    """Entries at equal distances, by spaces between them; with ``middle`` in the middle of a coefficient's width."""
    wide = pitch / (_POINTS * MILLIMETRES_A_POINT) * units_an_em()
    room = in_units("\N{FIGURE SPACE}\N{THIN SPACE}0.00")
    line, at = "", 0
    for index, entry in enumerate(entries):
        begin = index * wide + (max(0.0, (room - in_units(entry)) / 2.0) if middle else 0.0)
        more = _space(begin - at, least=index > 0) + entry
        line += more
        at += in_units(more)
    return line


def _space(wanted: float, *, least: bool) -> str:
    """Spaces of a width in the font's units, to half a hair space; ``least`` asks for one at least."""
    line = ""
    for space in _SPACES:
        count = int((wanted + in_units(_SPACES[-1]) / 2.0) // in_units(space))
        line += space * max(0, count)
        wanted -= max(0, count) * in_units(space)
    return line or ("\N{THIN SPACE}" if least else "")


def _shades(coefficients: list[list[float]], pitch: float, title: str) -> Markup:
    """The greys behind the coefficients, as many paths as there are greys. Opaque: paper needs no transparency."""
    most = max(map(len, coefficients), default=0)
    on = Drawing(most * pitch, len(coefficients) * LINE_MM, title)
    greys: dict[int, list[str]] = {}
    wide, high = pitch * SCALE, LINE_MM * SCALE
    for row, values in enumerate(coefficients):
        for column, value in enumerate(values):
            step = round(_GREYS * min(abs(value), 1.0))
            if step:
                # A line as thick as the row is high: half of what an area takes to draw.
                greys.setdefault(step, []).append(
                    f"M{column * wide:g} {row * high + (high - 1) / 2:g}h{wide - 2:g}"
                )
    for step, marks in sorted(greys.items()):
        level = round(255 * (1.0 - _DARKEST * step / _GREYS))
        on.path("".join(marks), stroke=f"#{level:02x}{level:02x}{level:02x}", width=high - 1)
    return Markup(on.svg())
