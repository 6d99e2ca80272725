"""The list of campaigns is searched and filtered by an address, without a script."""

from __future__ import annotations

import re
from pathlib import Path
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


def test_a_link_to_a_withdrawn_campaign_says_when_and_why(imported: Path, serve: Any, tmp_path: Path) -> None:
    """Two of the pages said that there is no such campaign, as if there had never been one."""
    copy = tmp_path / "copy.duckdb"
    copy.write_bytes(imported.read_bytes())
    own = serve(copy, False)
    document = {"campaign": "hidden-spindle-growth", "reason": "wrong piece"}
    assert own.ask("withdraw campaign", document)[0] == 200
    for path in (
        "campaign?name",
        "model?campaign",
        "map?campaign",
        "plan?campaign",
        "certificate/new?campaign",
    ):
        page = own.client.get(f"/{path}=hidden-spindle-growth")
        assert page.status_code == 404
        assert re.search(r"any more: it was withdrawn on 20\d\d-\d\d-\d\d \(wrong piece\)", page.text), path
    assert "there is no campaign &#39;none&#39;; the page" in own.client.get("/campaign?name=none").text


def test_an_approver_withdraws_a_campaign_on_its_page(imported: Path, serve: Any, tmp_path: Path) -> None:
    """No page could, though the pages' document says so; "-" was a reason, which reads as none."""
    copy = tmp_path / "copy.duckdb"
    copy.write_bytes(imported.read_bytes())
    own = serve(copy, False)
    name = "hidden-spindle-growth"
    assert f"withdraw {name}</button>" in own.client.get(f"/campaign?name={name}").text

    def withdrawn(typed: str, reason: str) -> Any:
        texts = {"campaign": name, "typed": typed, "reason": reason}
        return own.sent("/campaign/withdraw", data={"proof": own.proof(), **texts})

    assert "type the name of the campaign" in withdrawn("hidden", "wrong piece").text
    assert "say why campaign hidden-spindle-growth is withdrawn" in withdrawn(name, "-").text
    assert [row["campaign"] for row in own.ask("campaigns")[1]["campaigns"]] == [name, "load-cell"]
    assert withdrawn(name, "wrong piece").status_code == 200
    _, left = own.ask("campaigns")
    assert [row["campaign"] for row in left["campaigns"]] == ["load-cell"]
    assert [row["reason"] for row in left["withdrawn"]] == ["wrong piece"]
