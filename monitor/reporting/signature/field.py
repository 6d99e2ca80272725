"""The visible field of a signature: where the page has its place, with the signer's name and the moment of signing.

The words are outlines of our own font, so that the field brings no font into the file; the page says the same as text.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from fontTools.pens.basePen import BasePen
from fontTools.ttLib import TTFont

from monitor.reporting.resources import font_bytes

#: The element of the page that the field stands on, by its id; what it is called in the file.
PLACE, NAME = "signature-field", "Signature"
_POINTS_A_MM = 72.0 / 25.4
#: Width of that element and height of what it leaves white above it (``.signers`` in the style sheet).
_WIDTH, _HEIGHT = 70.0 * _POINTS_A_MM, 7.4 * _POINTS_A_MM
_SMALLEST_PT, _LETTERS_PT, _EDGE = 3.0, 7.0, 2.0


@dataclass(frozen=True)
class Place:
    """Where the field stands: the page (from 0), and left, bottom, right, top in points."""

    page: int
    box: tuple[int, int, int, int]


def place_in(reader: Any) -> Place | None:
    """Return the place of the field in an open PDF; None in one that has none: its signature is not to be seen."""
    names = reader.root.get("/Names", {}).get("/Dests", {}).get("/Names", [])
    marked = {str(names[index]): names[index + 1] for index in range(0, len(names), 2)}
    if PLACE not in marked:
        return None
    target = marked[PLACE]
    pages = reader.root["/Pages"]["/Kids"]
    page = next(
        index for index in range(len(pages)) if pages.raw_get(index).reference == target.raw_get(0).reference
    )
    x, y = float(target[2]), float(target[3])
    return Place(page, (round(x), round(y) + 1, round(x + _WIDTH), round(y + _HEIGHT)))


def field_drawing(name: str, moment: datetime) -> bytes:
    """Return the drawing of a field: a frame, the signer's name, and the moment (with an offset) after ISO 8601."""
    font = TTFont(io.BytesIO(font_bytes("DejaVuSans.ttf")), lazy=True)
    lines = (name, moment.isoformat(timespec="seconds"))
    room = _WIDTH - 4.0 * _EDGE
    widest = max(_width(font, line) for line in lines)
    size = max(_SMALLEST_PT, min(_LETTERS_PT, room / widest if widest else _LETTERS_PT))
    parts = [f"0.5 w 0.4 G 0.5 0.5 {_WIDTH - 2.0:.2f} {_HEIGHT - 2.5:.2f} re S", "0 g"]
    for line, base in zip(lines, (0.55 * _HEIGHT, 0.16 * _HEIGHT), strict=True):
        parts.extend(_outlines(font, line, size, (2.0 * _EDGE, base)))
    return " ".join(parts).encode("ascii")


def _glyphs(font: TTFont, line: str) -> list[str]:
    """The glyphs of what the font has of a line."""
    names = font.getBestCmap()
    return [names[ord(letter)] for letter in line if ord(letter) in names]


def _width(font: TTFont, line: str) -> float:
    """How wide a line is, in the size of its letters."""
    advances = font["hmtx"]
    return float(sum(advances[glyph][0] for glyph in _glyphs(font, line)) / font["head"].unitsPerEm)


def _outlines(font: TTFont, line: str, size: float, start: tuple[float, float]) -> Iterator[str]:
    """The letters of a line as filled paths, from the left end of its base line; none beyond the field."""
    glyphs, advances = font.getGlyphSet(), font["hmtx"]
    scale = size / float(font["head"].unitsPerEm)
    x, y = start
    for name in _glyphs(font, line):
        ahead = scale * advances[name][0]
        if x + ahead > _WIDTH - _EDGE:
            return
        pen = _ContentPen(glyphs, scale, (x, y))
        glyphs[name].draw(pen)
        if pen.parts:
            yield " ".join([*pen.parts, "f"])
        x += ahead


class _ContentPen(BasePen):  # type: ignore[misc]
    """Writes a glyph as operators of a PDF."""

    def __init__(self, glyphs: Any, scale: float, start: tuple[float, float]) -> None:
        super().__init__(glyphs)
        self.parts: list[str] = []
        self._scale, self._start = scale, start

    def _add(self, operator: str, *points: Sequence[float]) -> None:
        written = (
            f"{begin + self._scale * value:.2f}"
            for point in points
            for begin, value in zip(self._start, point, strict=True)
        )
        self.parts.append(" ".join([*written, operator]))

    def _moveTo(self, pt: Sequence[float]) -> None:
        self._add("m", pt)

    def _lineTo(self, pt: Sequence[float]) -> None:
        self._add("l", pt)

    def _curveToOne(self, pt1: Sequence[float], pt2: Sequence[float], pt3: Sequence[float]) -> None:
        self._add("c", pt1, pt2, pt3)

    def _closePath(self) -> None:
        self.parts.append("h")
