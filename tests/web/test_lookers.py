"""Who only looks: the audit by words, and what a viewer sees on the pages of those who may do more."""

from __future__ import annotations

import re
import time
from typing import Any

import pytest

#: Pages with a form of somebody else, and what a viewer reads there.
OTHERS = {
    "/import": "You have the role viewer; importing needs the role engineer: ask whoever keeps the users.",
    "/certificate/new?campaign=hidden-spindle-growth": "You have the role viewer; to preview or issue a certificate "
    "needs the role approver: ask whoever keeps the users.",
    "/model?campaign=hidden-spindle-growth": "You have the role viewer; to add an effect to the model needs the role "
    "engineer: ask whoever keeps the users.",
    "/machine?name=HU40-T": "You have the role viewer; to record an event needs the role engineer: ask whoever keeps "
    "the users.",
}


def test_the_audit_is_looked_through_by_words(local: Any) -> None:
    """Every word counts, in any column and case; the numbers are those of a count by hand over all entries."""
    _, answer = local.ask("audit", {"last": 10**6})
    rows = [
        f"{entry['made_at'][:10]} {entry['actor']} {entry['action']} {entry['subject']} {entry['key']}".lower()
        for entry in answer["entries"]
    ]
    assert len(rows) > 1
    for words in ("import", "IMPORT spindle", "load-cell", rows[0][:10], "import nobody-at-all", "%", "'"):
        by_hand = sum(all(word in row for word in words.lower().split()) for row in rows)
        page = local.client.get("/audit", params={"containing": words}).text
        assert page.count('data-title="Entry"') == by_hand, words
        assert ("No entry holds all of these words." in page) == (by_hand == 0)
    assert local.client.get("/audit?last=1").text.count('data-title="Entry"') == 1
    assert 'href="/audit?last=5">more</a>' in local.client.get("/audit?last=1").text
    refused = local.client.get("/audit", params={"containing": "a " * 21})
    assert refused.status_code == 400
    assert "at most 20 words" in refused.text


@pytest.mark.parametrize("path", OTHERS)
def test_a_viewer_reads_what_a_page_needs_instead_of_its_forms(
    path: str, imported: Any, serve: Any, tmp_path: Any
) -> None:
    copy = tmp_path / "copy.duckdb"
    copy.write_bytes(imported.read_bytes())
    served = serve(copy, True)

    def read(role: str) -> str:
        served.client.cookies.clear()
        served.client.post("/login", data={"token": served.tokens[role]})
        for _ in range(600):
            answer = served.client.get(path)
            assert answer.status_code == 200
            if 'class="waiting"' not in answer.text:
                break
            time.sleep(0.2)
        return re.sub(r"<[^>]+>|\s+", " ", answer.text).replace("&#39;", "'")

    assert OTHERS[path] in re.sub(" +", " ", read("viewer"))
    assert "You have the role" not in read("approver")
