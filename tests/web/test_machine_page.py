"""The page of a machine: what is there at once, and what comes when somebody scrolls to it."""

from __future__ import annotations

import html
import re
from typing import Any

from tests.web.test_pages import looked_at


def test_the_table_of_all_parameters_is_computed_for_whoever_scrolls_to_it(local: Any) -> None:
    # The first look identifies, for which all are followed; another period is not computed yet.
    looked_at(local, "/machine?name=HU40-T")
    address = "/machine?name=HU40-T&parameter=EXX&since=2026-01-01"
    page = looked_at(local, address)
    assert "<h2>All parameters</h2>" in page
    later = re.search(r'<section id="every" data-later="([^"]+)"', page)
    assert later is not None
    assert "Drift a year" not in page
    for _ in range(60):
        table = local.client.get(html.unescape(later[1]))
        if table.status_code != 202:
            break
    assert table.status_code == 200
    assert table.text.count("<tr") == 14  # the head and 13 parameters
    assert '<tr class="current">' in table.text
    # Once it is computed the page has it at once; without a script a link asks for it.
    again = looked_at(local, f"{address}&every=true")
    assert "Drift a year" in again
    assert "data-later" not in again
    assert local.client.get("/machine/parameters").status_code == 400
