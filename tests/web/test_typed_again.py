"""What somebody typed into a form that was refused is there to be mended, not to be typed again."""

from __future__ import annotations

import html
import re
from typing import Any

import pytest

from tests.web.test_pages import looked_at

CAMPAIGN = "hidden-spindle-growth"


def _boxes(page: str) -> dict[str, str]:
    """What the boxes of a page hold, by name; of boxes of the same name the last."""
    return {
        name[1]: html.unescape(value[1] if value else "")
        for tag in re.findall(r"<input [^>]*>", page)
        if (name := re.search(r' name="([^"]+)"', tag))
        for value in [re.search(r' value="([^"]*)"', tag)]
    }


@pytest.mark.parametrize(
    ("at", "says"),
    [
        ("2999-01-01T00:00:00Z", "lies in the future"),
        ("2026-02-31T07:00:00Z", "&#39;at&#39;"),
        ("04.03.2026 07:00", "&#39;at&#39;"),
        ("9" * 400, "&#39;at&#39;"),
    ],
)
def test_an_event_of_an_impossible_moment_is_mended_in_its_form(local: Any, at: str, says: str) -> None:
    looked_at(local, "/machine?name=HU40-T")
    texts = {"machine": "HU40-T", "text": "<b>belt</b> & pulley", "kind": "crash", "at": at}
    sent = local.client.post(
        "/machine/event", data={"proof": local.proof(), **texts},
        headers={"Referer": "http://127.0.0.1:8765/machine?name=HU40-T&parameter=EB0C&colour=day"},
    )  # fmt: skip
    assert sent.status_code == 303
    address, _, fragment = sent.headers["location"].partition("#")
    assert fragment == "event"
    for _ in range(2):
        page = local.client.get(address).text
        assert says in page
        assert {name: _boxes(page)[name] for name in texts} == texts
        assert "<h2>EB0C: squareness of axis C to X</h2>" in page
    # Once it is right, the form of the page is empty again.
    assert _boxes(local.client.get("/machine?name=HU40-T").text)["text"] == ""
    assert local.client.get("/machine?name=HU40-T&refused=guessed").status_code == 200


@pytest.mark.parametrize("wanted", ["0,5x", "NaN", "-1", "1e400", "0", "<script>"])
def test_a_plan_for_an_uncertainty_that_is_none_keeps_what_was_typed(local: Any, wanted: str) -> None:
    page = looked_at(local, f"/plan?campaign={CAMPAIGN}&u_EB0C={wanted}&u_EA0B=2,5")
    assert "the wanted uncertainty of EB0C is a positive number" in page
    assert "<script>" not in page.partition("<main")[2].replace('<script type="application/json"', "")
    boxes = _boxes(page)
    assert (boxes["u_EB0C"], boxes["u_EA0B"]) == (wanted, "2,5")
    assert "Present plan" in page


@pytest.mark.parametrize(
    ("asked", "box", "says"),
    [
        ("separate=EBZ:poly2", ("separate", "EBZ:poly2"), "name two effects with a comma"),
        ("separate=EBZ:poly2,EBZ:poly2", ("separate", "EBZ:poly2,EBZ:poly2"), "name two different effects"),
        ("separate=EBZ:up,EZZ:poly2", ("separate", "EBZ:up,EZZ:poly2"), "EBZ:up"),
        ("balls=99", ("balls", "99"), "choose 1 to"),
        ("poses=nine", ("poses", "nine"), "is a whole number"),
    ],
)
def test_a_plan_that_is_refused_is_mended_in_its_form(
    local: Any, asked: str, box: tuple[str, str], says: str
) -> None:
    page = looked_at(local, f"/plan?campaign={CAMPAIGN}&{asked}")
    assert says in page
    assert _boxes(page)[box[0]] == box[1]
    assert "Present plan" in page


def test_a_pair_of_one_parameter_is_refused_above_the_form(local: Any) -> None:
    page = looked_at(local, f"/campaign?name={CAMPAIGN}&first=EB0C&second=EB0C")
    assert "choose two different parameters" in page
    assert "<h2>Do the days differ?</h2>" in page
    assert page.count('<option value="EB0C" selected>') == 2
    assert "whole number" in looked_at(local, f"/campaign?name={CAMPAIGN}&first=EB0C&second=EA0B&run=1,5")
