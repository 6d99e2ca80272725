"""Draws a plot as a few lines of SVG, without a drawing library: quick enough for a hundred pages a night.

The figures of the command line are drawn by matplotlib (``figures_*``); one of them costs 0.1 to 0.3 s and 40 to
120 kB, these 1 ms and 5 kB. All lengths are in units of a tenth of a millimetre.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape

from monitor.reporting.palette import INK, MID, PALE
from monitor.reporting.svg.letter_widths import BOLD, in_units, units_an_em

#: Units a millimetre.
SCALE = 10.0
#: Height of letters: 6.5 pt.
LETTER = 22.9
#: A letter of DejaVu Sans is on the average 0.56 of its height wide; what has to fit is counted with more.
WIDE = 0.6


@dataclass
class Drawing:
    """An SVG picture of a size in mm, for the inside of a page; ``marks`` are painted in their order."""

    width_mm: float
    height_mm: float
    title: str
    marks: list[str] = field(default_factory=list)

    def line(
        self, x1: float, y1: float, x2: float, y2: float, colour: str, width: float, dash: str = ""
    ) -> None:
        """Add a straight line."""
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        self.marks.append(
            f'<path d="M{x1:.1f} {y1:.1f}L{x2:.1f} {y2:.1f}" stroke="{colour}" '
            f'stroke-width="{width:g}"{dashes} fill="none"/>'
        )

    def path(self, d: str, *, stroke: str = "none", width: float = 0.0, fill: str = "none") -> None:
        """Add any path: many lines of one look in one mark."""
        self.marks.append(f'<path d="{d}" stroke="{stroke}" stroke-width="{width:g}" fill="{fill}"/>')

    def dots(self, d: str, colour: str, size: float) -> None:
        """Add round dots at the lines of no length of ``d``, in one mark."""
        self.marks.append(
            f'<path d="{d}" stroke="{colour}" stroke-width="{size:g}" stroke-linecap="round" fill="none"/>'
        )

    def text(
        self, x: float, y: float, text: str, *, anchor: str = "start", bold: bool = False, colour: str = INK,
        turned: bool = False,
    ) -> None:  # fmt: skip
        """Add a text with its base line at ``y``; ``turned`` reads upwards."""
        weight = ' font-weight="700"' if bold else ""
        turn = f' transform="rotate(-90 {x:.1f} {y:.1f})"' if turned else ""
        self.marks.append(
            f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}"{weight}{turn}>{escape(text)}</text>'
        )

    def svg(self) -> str:
        """Return the picture, for the inside of a page."""
        return (
            f'<svg class="plot" role="img" xmlns="http://www.w3.org/2000/svg" width="{self.width_mm:g}mm" '
            f'height="{self.height_mm:g}mm" viewBox="0 0 {self.width_mm * SCALE:g} {self.height_mm * SCALE:g}" '
            f'font-family="DejaVu Sans, sans-serif" font-size="{LETTER:g}"><title>{escape(self.title)}</title>'
            f"{''.join(self.marks)}</svg>"
        )


@dataclass(frozen=True)
class Panel:
    """A rectangle of a drawing with its two scales: left end ``x0``, top, width, height, and their ranges."""

    x0: float
    top: float
    width: float
    height: float
    across: tuple[float, float]
    up: tuple[float, float]

    def x(self, value: float) -> float:
        """Return the position of a value from left to right."""
        return self.x0 + self.width * (value - self.across[0]) / (self.across[1] - self.across[0])

    def y(self, value: float) -> float:
        """Return the position of a value from top to bottom."""
        return self.top + self.height * (self.up[1] - value) / (self.up[1] - self.up[0])

    def frame(
        self, on: Drawing, across: str, up: str, *, ticks: int = 5, named: dict[float, str] | None = None
    ) -> None:
        """Draw axes with ticks and names; ``named`` ticks across replace numbers."""
        bottom = self.top + self.height
        shown = words_of_ticks(nice_ticks(*self.across, ticks)) if named is None else named
        for value, label in shown.items():
            at = self.x(value)
            on.line(at, bottom, at, bottom + 8, MID, 2)
            on.text(at, bottom + 12 + LETTER, label, anchor="middle")
        for value, label in words_of_ticks(nice_ticks(*self.up, ticks + 1)).items():
            at = self.y(value)
            on.line(self.x0, at, self.x0 + self.width, at, PALE, 1.5)
            on.line(self.x0 - 8, at, self.x0, at, MID, 2)
            on.text(self.x0 - 13, at + 0.36 * LETTER, label, anchor="end")
        if self.up[0] < 0.0 < self.up[1]:
            on.line(self.x0, self.y(0.0), self.x0 + self.width, self.y(0.0), MID, 2.4)
        on.path(
            f"M{self.x0:g} {self.top:g}L{self.x0:g} {bottom:g}L{self.x0 + self.width:g} {bottom:g}",
            stroke=MID, width=2.4,
        )  # fmt: skip
        on.text(self.x0 + self.width / 2, bottom + 18 + 2.1 * LETTER, across, anchor="middle")
        beside = max(66.0, tick_room(self.up, ticks + 1) + 8.0)
        on.text(self.x0 - beside, self.top + self.height / 2, up, anchor="middle", turned=True)


def nice_ticks(low: float, high: float, most: int) -> list[float]:
    """Return at most ``most`` round numbers between two ends, a step of 1, 2 or 5 times a power of ten apart."""
    if not high > low:
        return [low]
    least = (high - low) / most
    power = 10.0 ** math.floor(math.log10(least))
    step = next(digit * power for digit in (1.0, 2.0, 5.0, 10.0) if digit * power >= least * (1.0 - 1e-9))
    first = math.ceil(low / step - 1e-9)
    return [index * step for index in range(first, math.floor(high / step + 1e-9) + 1)]


def text_width(text: str, *, bold: bool = False) -> float:
    """Return the width of a text in units of a drawing."""
    return in_units(text) / units_an_em() * LETTER * (BOLD if bold else 1.0)


def tick_room(shown: tuple[float, float], most: int) -> float:
    """Return how far the widest number beside an axis reaches from it."""
    return 13.0 + max(map(text_width, words_of_ticks(nice_ticks(*shown, most)).values()), default=0.0)


def shortened(text: str, room: float) -> str:
    """Return a text no wider than its room; what is cut off is marked."""
    most = int(room / (WIDE * LETTER))
    return text if len(text) <= most else text[: most - 1] + "…"


def words_of_ticks(ticks: Sequence[float]) -> dict[float, str]:
    """Return the numbers along an axis as written, with as many digits as tell them from each other."""
    for digits in range(6, 17):
        written = {tick: tick_words(tick, digits=digits) for tick in ticks}
        if len(set(written.values())) == len(written):
            break
    return written


def tick_words(value: float, sign: str = ".", digits: int = 6) -> str:
    """Write a number along an axis, with the decimal ``sign`` of a language."""
    return (
        f"{value:.{digits}g}".replace("-", "\N{MINUS SIGN}").replace(".", sign) if abs(value) > 1e-12 else "0"
    )


def arrow_head(x1: float, y1: float, x2: float, y2: float, size: float) -> str:
    """Return the path of a triangle at the end of a line from (x1, y1), smaller on a short line, none on a point."""
    length = math.hypot(x2 - x1, y2 - y1)
    if length < 1.0:
        return ""
    size = min(size, 0.6 * length)
    ux, uy = (x2 - x1) / length, (y2 - y1) / length
    bx, by = x2 - 1.6 * size * ux, y2 - 1.6 * size * uy
    return (
        f"M{x2 + 0.4 * size * ux:.1f} {y2 + 0.4 * size * uy:.1f}L{bx - 0.7 * size * uy:.1f} {by + 0.7 * size * ux:.1f}"
        f"L{bx + 0.7 * size * uy:.1f} {by - 0.7 * size * ux:.1f}Z"
    )
