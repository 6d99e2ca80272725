"""The word that lies across every page of a draft, light enough that what stands over it is read."""

from __future__ import annotations

import base64
from html import escape

from monitor.reporting.svg.letter_widths import MILLIMETRES_A_POINT, in_mm

#: A sheet of A4 in mm, the length of the word along its diagonal, and its grey: text over it keeps nearly all of its
#: contrast (17 to 1 where white paper has 21 to 1).
_WIDTH_MM, _HEIGHT_MM, _LENGTH_MM, _GREY = 210.0, 297.0, 200.0, "#e9e9ec"


def draft_word(word: str) -> str:
    """Return a sheet of A4 with the ``word`` along its diagonal, as the data address of a picture (SVG)."""
    # Letters in mm: the picture's units are those of the sheet.
    letters = _LENGTH_MM / in_mm(word, 1.0 / MILLIMETRES_A_POINT)
    across, down = f"{_WIDTH_MM / 2:g}", f"{_HEIGHT_MM / 2 + 0.36 * letters:.2f}"
    turned = f"rotate(-54.7 {_WIDTH_MM / 2:g} {_HEIGHT_MM / 2:g})"
    picture = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_WIDTH_MM:g}mm" height="{_HEIGHT_MM:g}mm" '
        f'viewBox="0 0 {_WIDTH_MM:g} {_HEIGHT_MM:g}">'
        f'<text x="{across}" y="{down}" text-anchor="middle" fill="{_GREY}" font-family="DejaVu Sans" '
        f'font-size="{letters:.2f}" transform="{turned}">{escape(word)}</text></svg>'
    )
    return "data:image/svg+xml;base64," + base64.b64encode(picture.encode("utf-8")).decode("ascii")
