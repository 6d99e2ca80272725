"""What somebody typed into a form that was refused is there to be mended, not to be typed again."""

from __future__ import annotations

import html
import re
import tomllib
from datetime import date, datetime
from pathlib import Path
from typing import Any

import pytest

from monitor.exceptions import InputError
from monitor.web.laboratory_form import laboratory_file
from monitor.web.pages.issuing import _document, _refused
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
        ("2026-02-31T07:00:00Z", "there is no such day or time"),
        ("31.02.2026 07:00", "is a day, such as 2026-03-02 or 02.03.2026"),
        ("9" * 400, "write a day or a time as 2026-03-05"),
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
        answer = local.client.get(address)
        assert answer.status_code == 400
        page = answer.text
        assert says in page
        assert {name: _boxes(page)[name] for name in texts} == texts
        assert "<h2>EB0C: squareness of axis C to X</h2>" in page
    # Once it is right, the form of the page is empty again.
    assert _boxes(local.client.get("/machine?name=HU40-T").text)["text"] == ""
    assert local.client.get("/machine?name=HU40-T&refused=guessed").status_code == 200


def test_an_event_is_dated_as_people_write_and_its_page_stays_as_it_was_looked_at(
    imported: Path, serve: Any, tmp_path: Path
) -> None:
    """Without an offset it is the time of the shop's clock, -05:00 for the runs of HU40-T."""
    copy = tmp_path / "copy.duckdb"
    copy.write_bytes(imported.read_bytes())
    own = serve(copy, False)
    looked_at(own, "/machine?name=HU40-T")
    query = "name=HU40-T&parameter=EB0C&since=2026-03-03&until=2026-03-05&refused=before"
    typed = {
        "2026-03-04": "2026-03-04T00:00:00-05:00",
        "05.03.2026": "2026-03-05T00:00:00-05:00",
        "05.03.2026, 07:10 Uhr": "2026-03-05T07:10:00-05:00",
        "2026-03-05 07:20": "2026-03-05T07:20:00-05:00",
        "2026-03-05T14:30:00+01:00": "2026-03-05T08:30:00-05:00",
    }
    for at in typed:
        texts = {"machine": "HU40-T", "text": at, "kind": "note", "at": at}
        sent = own.client.post(
            "/machine/event", data={"proof": own.proof(), **texts},
            headers={"Referer": f"http://127.0.0.1:8765/machine?{query}"},
        )  # fmt: skip
        assert sent.headers["location"] == f"/machine?{query.replace('&refused=before', '')}#events"
    recorded = own.ask("event", {"machine": "HU40-T"})[1]["events"]
    moments = {event["description"]: datetime.fromisoformat(event["happened_at"]) for event in recorded}
    assert moments == {at: datetime.fromisoformat(wanted) for at, wanted in typed.items()}


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


@pytest.mark.parametrize("button", ["issue", "preview", "keep"])
@pytest.mark.parametrize(
    ("box", "text", "says"),
    [
        ("temperature.machine_degC", "20,5x", "is a number, such as 20.5"),
        ("item.received_on", "31.02.2026", "is a day, such as 2026-03-02 or 02.03.2026"),
        ("standards.1.issued_on", "March", "is a day, such as 2026-03-02 or 02.03.2026"),
        ("standards.1.issued_on", "20260302", "is a day, such as 2026-03-02 or 02.03.2026"),
    ],
)
def test_a_box_of_a_certificate_that_cannot_be_read_is_marked(
    local: Any, button: str, box: str, text: str, says: str
) -> None:
    """Keeping the answers as a file was refused on a page of its own, and all boxes were empty."""
    texts = {"campaign": CAMPAIGN, "run": "20", "customer.name": "Mill & Sons, 1/2 Road", box: text}
    page = local.sent("/certificate/new", data={"proof": local.proof(), "button": button, **texts})
    assert page.status_code == 400
    marked = re.findall(r'<input name="([^"]+)"[^>]* aria-invalid="true"', page.text)
    # Where an item may not apply, the box of the reason is marked with it.
    assert marked in ([box], [box, f"na:{box}"])
    assert says in html.unescape(page.text)
    boxes = _boxes(page.text)
    assert (boxes[box], boxes["customer.name"]) == (text, texts["customer.name"])


@pytest.mark.parametrize("text", ["02.03.2026", "2. 3. 2026", "2026-03-02"])
def test_a_day_is_read_as_the_german_form_has_it_too(text: str) -> None:
    assert tomllib.loads(laboratory_file({"item.received_on": text})) == {
        "item": {"received_on": date(2026, 3, 2)}
    }


def test_a_page_names_no_option_of_the_command_line(local: Any) -> None:
    """It said --week."""
    assert "--week" not in looked_at(local, "/reports?week=2026-W99")
    assert "week 2026-W99: write a year and a week of it" in looked_at(local, "/reports?week=2026-W99")
    assert "last -1: how many entries" in local.client.get("/audit?last=-1").text


def test_a_form_is_refused_in_its_own_words() -> None:
    """It said that laboratory.toml was refused, and to write without quotes, of a file that nobody wrote."""
    fault = "item.received_on is a date without quotes, for example 2026-03-02, but is 'x'"
    outcome = _refused(InputError(f"/tmp/a/laboratory.toml was refused:\n  {fault}"), "/tmp/a")
    assert outcome.refusal is not None
    assert outcome.refusal.error == "these boxes were refused:"
    assert outcome.refusal.faults == (fault.replace(" without quotes", ""),)
    assert set(outcome.faults) == {"item.received_on"}


@pytest.mark.parametrize("number", ["A" * 3000, "A\u202e1"])
def test_a_preview_judges_the_number_as_an_issue_does(number: str) -> None:
    with pytest.raises(InputError, match="is one line of at most") as refused:
        _document({"campaign": CAMPAIGN, "number": number}, draft=True)
    assert len(str(refused.value)) < 300
