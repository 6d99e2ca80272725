"""Keeps the last page of a document from being more than half empty, by breaks that leave each page half full.

A template marks what may begin a page by ids that start with ``break-`` (or ``machine-``), and its end by the id
``end``. WeasyPrint tells where these stand; the document is then laid out once more with one or two breaks set by hand.
"""

from __future__ import annotations

from itertools import combinations, pairwise
from typing import Any

from monitor.reporting.pdf.layout_engine import Document

#: What may begin a page.
_MAY_BEGIN = ("break-", "machine-")
#: Margins at head and foot as a part of a page's height (17 to 19 mm of 297 mm), and what they leave.
_MARGIN = 0.062
_ROOM = 1.0 - 2.0 * _MARGIN
#: Boxes of WeasyPrint that no page breaks, and how many boxes stand side by side at most.
_UNBROKEN, _BESIDE = ("LineBox", "TableRowBox"), 3
#: What a closer setting of a certificate saves of the height of all that is set (0.049), and the part of a page that
#: stays white at its foot, because what follows is not broken.
CLOSER, _LEFT = 0.05, 0.03
#: A page is half full where its text reaches the middle of the sheet.
_HALF = 0.5


def ends_early(document: Document) -> bool:
    """Return whether the last of several pages is less than half full."""
    last = document.pages[-1]
    return len(document.pages) > 1 and "end" in last.anchors and last.anchors["end"][1] < _HALF * last.height


def closeness_saves(document: Document, saved: float) -> bool:
    """Return whether what the pages hold may fit on one fewer when a part of its height is ``saved``."""
    filled = sum(_end_of(page._page_box.children[0]) / page.height - _MARGIN for page in document.pages)
    return bool(filled * (1.0 - saved) <= (len(document.pages) - 1) * (_ROOM - _LEFT))


def _end_of(box: Any) -> float:
    """Return where the text of a box ends; a box that goes on on the next page reaches to the foot of this one."""
    inside = [child for child in getattr(box, "children", ()) if child.element_tag != "html"]
    if not inside or type(box).__name__ in _UNBROKEN:
        return float(box.position_y + box.margin_height())
    return max(map(_end_of, inside[-_BESIDE:]))


def filling_breaks(document: Document) -> tuple[tuple[str, ...], ...]:
    """Return the ids to begin the last page, and those for the last two, so that the emptiest is as full as can be.

    Without those that do not leave all of them half full, as far as can be told from where things stand now: what was
    left white at the foot of a page counts as filled, so the first may fail where the second does not.
    """
    best = (_breaks(document, count) for count in (1, 2) if len(document.pages) > count)
    return tuple(names for names in best if names)


def with_breaks_before(html: str, names: tuple[str, ...]) -> str:
    """Return a page in which each of what has these ids begins a page."""
    rules = "".join(f"#{name} {{ break-before: page; margin-top: 0; }}" for name in names)
    return html.replace("</style>", f"{rules}</style>", 1)


def _breaks(document: Document, count: int) -> tuple[str, ...]:
    """The best ``count`` breaks before the last page: each begins a page of the last ``count``."""
    begins, end = _strip(document, count + 1)
    best: tuple[float, tuple[str, ...]] = (0.0, ())
    for names in combinations(begins, count):
        heights = [
            after - before for before, after in pairwise([0.0, *(begins[name] for name in names), end])
        ]
        if max(heights) <= _ROOM:
            best = max(best, (min(heights), names))
    return best[1] if best[0] + _MARGIN >= _HALF else ()


def _strip(document: Document, count: int) -> tuple[dict[str, float], float]:
    """Where the breaks and the end stand on a strip of the last ``count`` pages without margins, in pages."""
    begins: dict[str, float] = {}
    for at, page in enumerate(document.pages[-count:]):
        for name, corners in page.anchors.items():
            if name.startswith(_MAY_BEGIN):
                begins[name] = at * _ROOM + corners[1] / page.height - _MARGIN
    last = document.pages[-1]
    end = (count - 1) * _ROOM + last.anchors["end"][1] / last.height - _MARGIN
    return dict(sorted(begins.items(), key=lambda begin: begin[1])), end
