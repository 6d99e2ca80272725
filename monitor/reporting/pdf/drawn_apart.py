"""Takes the drawings of a page out of it before it is laid out: each becomes a picture that its address holds.

Inside the page every line of a drawing would be read as an element of it and given its style, a tenth of the time of a
page of a health report; what is drawn, with its alternative text, is the same.
"""

from __future__ import annotations

import base64
import re

#: A drawing as ``svg.plot`` writes it; no other mark of a page ends so.
_DRAWING = re.compile(r'<svg class="plot".*?<title>(.*?)</title>.*?</svg>', re.DOTALL)


def drawn_apart(html: str) -> str:
    """Return a page whose drawings are pictures with their titles as alternative texts."""
    return _DRAWING.sub(_picture, html)


def _picture(drawing: re.Match[str]) -> str:
    content = base64.b64encode(drawing[0].encode("utf-8")).decode("ascii")
    title = drawing[1].replace('"', "&quot;")
    return f'<img class="plot" alt="{title}" src="data:image/svg+xml;base64,{content}">'
