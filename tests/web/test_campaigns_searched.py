"""The list of campaigns is searched and filtered by an address, without a script."""

from __future__ import annotations

import re
from typing import Any

import pytest


@pytest.mark.parametrize(
    ("query", "listed"),
    [
        ("", ["hidden-spindle-growth", "load-cell"]),
        ("containing=SPINDLE+hu40", ["hidden-spindle-growth"]),
        ("containing=spindle+cell", []),
        ("containing=%25", []),
        ("method=curve", ["load-cell"]),
        ("machine=HU40-T&method=samba&containing=growth", ["hidden-spindle-growth"]),
        ("machine=HU40-T&method=curve", []),
    ],
)
def test_campaigns_are_searched_by_words_machine_and_method(
    local: Any, query: str, listed: list[str]
) -> None:
    page = local.client.get(f"/campaigns?{query}")
    assert page.status_code == 200
    assert re.findall(r'data-title="Campaign"><a href="[^"]*">([^<]*)', page.text) == listed
    # The box comes before the first row: the keyboard meets it first.
    assert page.text.index('name="containing"') < page.text.index("<table")
    documents = dict(
        pair.split("=") for pair in query.replace("+", " ").replace("%25", "%").split("&") if pair
    )
    status, answer = local.ask("campaigns", documents)
    assert (status, [row["campaign"] for row in answer["campaigns"]]) == (200, listed)
    refused = local.client.get("/campaigns?containing=" + "+".join("a" * 21))
    assert (refused.status_code, "containing: at most 20 words" in refused.text) == (400, True)
