"""The page of a machine: what is there at once, and what comes when somebody scrolls to it."""

from __future__ import annotations

import html
import json
import re
from typing import Any

from monitor.documents import from_document, to_document
from monitor.web.pages.machine import _ends, _within
from monitor.workflow.history.values import ValuesAnswer
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


def test_a_period_is_cut_of_the_history_as_the_database_cuts_it(local: Any) -> None:
    """The page shows what the question answers for the same ends."""
    looked_at(local, "/machine?name=HU40-T")
    for since, until in (
        ("2026-03-03", ""),
        ("", "2026-03-04"),
        ("2026-03-03", "2026-03-05"),
        ("2030-01-01", ""),
    ):
        ends = {"since": since, "until": until}
        document = {key: f"{text}T00:00:00Z" for key, text in ends.items() if text}
        status, answer = local.ask("values", {"machine": "HU40-T", **document})
        assert status == 200
        shown = values_of_page(local, since, until)
        assert shown == answer
    refused = local.client.get("/machine?name=HU40-T&since=yesterday")
    assert refused.status_code == 400
    assert "write dates such as 2026-03-02" in refused.text


def values_of_page(local: Any, since: str, until: str) -> Any:
    """What the page cuts of the whole history, as the interface would answer it."""
    _, whole = local.ask("values", {"machine": "HU40-T"})
    return json.loads(
        json.dumps(to_document(_within(from_document(ValuesAnswer, whole), **_ends(since, until))))
    )
