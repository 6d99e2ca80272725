"""A parameter has one name in plain words on every page: the one that its machine's chain gives it."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable
from typing import Any

from tests.web.test_pages import looked_at

_ROW = re.compile(
    r'data-title="Parameter">(?:<a [^>]*>)?([^<]+?)(?:</a>)? <span class="quiet">([^<]+)</span>'
)
_OPTION = re.compile(r'<option value="([^"]+)"[^>]*>\1 – ([^<]+)</option>')
_UNIT = re.compile(r", (µm|mm|µrad|mrad|1|°)(/[^,]*)?$")


def names_on(pages: Iterable[str]) -> dict[str, set[str]]:
    """What the tables and choices of pages call each parameter, without its unit."""
    names = defaultdict(set)
    for text in pages:
        for symbol, words in (*_ROW.findall(text), *_OPTION.findall(text)):
            names[symbol].add(_UNIT.sub("", words))
    return names


def test_every_page_calls_a_parameter_by_the_same_name(local: Any) -> None:
    """Pages of campaign, map and plan had the words of the tables, which do not know the chain."""
    campaign = "hidden-spindle-growth"
    pages = [
        looked_at(local, address)
        for address in (
            "/machine?name=HU40-T", f"/campaign?name={campaign}", f"/map?campaign={campaign}&points=3",
            f"/plan?campaign={campaign}",
        )
    ]  # fmt: skip
    of_each = [names_on([text]) for text in pages]
    for names in of_each:
        assert len(names) >= 5
        # w C B X b Z Y (C1) t: Y follows Z in the branch of the tool.
        assert names["EA0Y"] == {"squareness Y-Z"}
    assert {symbol: words for symbol, words in names_on(pages).items() if len(words) > 1} == {}
