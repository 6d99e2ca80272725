"""The width of a text in our font: for what has to fit before the page is laid out."""

from __future__ import annotations

from functools import cache, lru_cache
from io import BytesIO

from fontTools.ttLib import TTFont

from monitor.reporting.resources import FONT_FILES, font_bytes

MILLIMETRES_A_POINT = 25.4 / 72.0
#: Bold letters of DejaVu Sans are at most so much wider (digits 1.09, small letters 1.05 to 1.12).
BOLD = 1.12


@lru_cache(maxsize=4096)
def in_units(text: str) -> int:
    """Return the width of a text in the font's units; a letter that it lacks counts an em."""
    em, widths = _widths()
    return sum(widths.get(ord(letter), em) for letter in text)


def units_an_em() -> int:
    """Return the font's units an em."""
    return _widths()[0]


def in_mm(text: str, points: float) -> float:
    """Return the width of a text in mm, in letters of so many points."""
    return in_units(text) / units_an_em() * points * MILLIMETRES_A_POINT


@cache
def _widths() -> tuple[int, dict[int, int]]:
    font = TTFont(BytesIO(font_bytes(FONT_FILES[0][2])), lazy=True)
    metrics = font["hmtx"]
    return font["head"].unitsPerEm, {code: metrics[name][0] for code, name in font.getBestCmap().items()}
