"""What a form led to has an address: it is reloaded, left and gone back to without sending the form again."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from monitor.web.outcomes import MOST, MOST_OF_USER, Outcomes

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CAMPAIGN = "hidden-spindle-growth"


def _files(content: bytes = b"hello") -> dict[str, Any]:
    return {"files": [("file", ("c.zip", content))]}


@pytest.mark.parametrize(
    ("path", "texts", "files", "status", "says"),
    [
        ("/import", {}, _files(), 400, "c.zip is no zip that can be read"),
        ("/certificates/verify", {}, _files(), 200, "This file does not hold"),
        ("/certificate/new", {"campaign": CAMPAIGN, "button": "fill"}, {}, 400, "choose the laboratory"),
        (
            "/certificate/new",
            {"campaign": CAMPAIGN, "run": "20", "button": "issue", "customer.name": "Mill & Sons"},
            {},
            400,
            "Mill &amp; Sons",
        ),
        ("/certificates/verify", {}, {}, 400, "choose the PDF of a certificate"),
        ("/certificates/withdraw", {"number": "none", "reason": "x"}, {}, 404, "none"),
        ("/certificates/withdraw", {"number": "none"}, {}, 400, "the form lacks &#39;reason&#39;"),
        (
            "/machine/event",
            {"machine": "HU40-T", "text": "belt", "at": "yesterday"},
            {},
            400,
            "write a day or a time as 2026-03-05",
        ),
        (
            "/machine/event",
            {"machine": "HU41-T", "text": "belt", "at": "2026-03-05"},
            {},
            404,
            "did you mean &#39;HU40-T&#39;",
        ),
        ("/model/add", {"campaign": CAMPAIGN, "effect": "EZZ1:up", "to": "samba"}, {}, 400, "EZZ1"),
        ("/model/undo", {"campaign": CAMPAIGN, "effect": "EXX:reversal", "model": "none"}, {}, 404, "none"),
        ("/work/cancel", {"number": "one"}, {}, 400, "a whole number"),
    ],
)
def test_a_form_is_answered_with_the_address_of_its_outcome(
    local: Any, path: str, texts: dict[str, str], files: dict[str, Any], status: int, says: str
) -> None:
    """Chromium shows the answer to a POST once: back and forward end in ERR_CACHE_MISS (seen on 25 November 2026)."""
    sent = local.client.post(path, data={"proof": local.proof(), **texts}, **files)
    assert sent.status_code == 303
    for _ in range(2):
        page = local.client.get(sent.headers["location"])
        assert page.status_code == status
        assert says in page.text


def test_a_refusal_leads_back_to_its_form_and_to_no_other_server(local: Any) -> None:
    fields = {"proof": local.proof(), "machine": "HU41-T", "text": "belt", "at": "2026-03-05"}
    for referer, wanted in (
        ("http://127.0.0.1:8765/machine?name=HU40-T&colour=day", "/machine?name=HU40-T&amp;colour=day"),
        ("http://127.0.0.1:8765//elsewhere.example/x", "/"),
        ("", None),
    ):
        headers = {"Referer": referer} if referer else {}
        page = local.sent("/machine/event", data=fields, headers=headers).text
        assert re.findall(r'<a href="([^"]*)">back to the form', page) == ([] if wanted is None else [wanted])
    gone = local.client.get("/refused?why=guessed")
    assert gone.status_code == 404
    assert "not held any more" in gone.text


def test_what_somebody_filled_in_is_shown_to_nobody_else(imported: Path, serve: Any, tmp_path: Path) -> None:
    copy = tmp_path / "copy.duckdb"
    shutil.copyfile(imported, copy)
    served = serve(copy, True)

    def as_role(role: str) -> TestClient:
        served.client.cookies.clear()
        served.client.post("/login", data={"token": served.tokens[role]})
        client: TestClient = served.client
        return client

    as_role("approver")
    fields = {"proof": served.proof(), "campaign": CAMPAIGN, "button": "issue", "customer.name": "Mill Ltd"}
    address = served.client.post("/certificate/new", data=fields).headers["location"]
    assert "Mill Ltd" in served.client.get(address).text
    other = as_role("engineer").get(address)
    assert "Mill Ltd" not in other.text
    assert "what was filled in here is not held any more" in other.text
    unknown = served.client.get("/certificates?checked=guessed")
    assert unknown.status_code == 404
    assert "choose the file again" in unknown.text


def test_the_oldest_outcomes_are_forgotten_and_nobody_pushes_out_another() -> None:
    outcomes = Outcomes()
    first = outcomes.hold("ada", "first")
    keys = [outcomes.hold("ben", str(number)) for number in range(MOST + 1)]
    assert outcomes.outcome_of("ada", first) == "first"
    assert outcomes.outcome_of("ben", first) is None
    assert outcomes.outcome_of("ben", keys[-MOST_OF_USER - 1]) is None
    assert outcomes.outcome_of("ben", keys[-MOST_OF_USER]) == str(MOST + 1 - MOST_OF_USER)
    for number in range(MOST):
        outcomes.hold(f"user {number}", number)
    assert outcomes.outcome_of("ada", first) is None
