"""What a form led to has an address: it is reloaded, left and gone back to without sending the form again."""

from __future__ import annotations

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
