"""Questions that programs ask by HTTP stand in the list of work, and can be taken back there."""

from __future__ import annotations

import html
import io
import re
import threading
import zipfile
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("fastapi", reason="the extra web is not installed")
pytest.importorskip("plotly", reason="the extra web is not installed")

from monitor.store import Database
from monitor.web.desk import Desk
from monitor.web.ticket import Ticket
from monitor.web.users import Role, User
from monitor.web.words import asked_for
from monitor.workflow.intake import importing

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
ENDLESS = "SELECT count(*) FROM range(1000000000000) a, range(1000000) b WHERE a.range % 7 = b.range % 5"


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory, serve: Any) -> Any:
    path = tmp_path_factory.mktemp("programs") / "monitor.duckdb"
    Database(path).close()
    return serve(path, True)


def asked(
    served: Any, aside: ThreadPoolExecutor, role: str, question: str, **body: Any
) -> tuple[Future[Any], Ticket]:
    """What will be answered to a program of a role, and the ticket that stands in the list meanwhile."""
    desk: Desk = served.client.app._app.state.desk
    headers = {"Authorization": f"Bearer {served.tokens[role]}"}
    answer = aside.submit(served.client.post, f"/api/v1/{question}", headers=headers, **body)
    while True:
        for ticket in desk.under_way():
            if ticket.question == question:
                return answer, ticket
        assert not answer.done(), answer.result().text


def page_of(served: Any, role: str) -> tuple[str, str]:
    """The list of work as a role reads it, and the proof of its forms."""
    served.client.cookies.clear()
    served.client.post("/login", data={"token": served.tokens[role]})
    page = served.client.get("/work").text
    proof = re.search(r'name="proof" value="([0-9a-f]{64})"', page)
    return html.unescape(page), "" if proof is None else proof[1]


def test_a_query_without_end_is_listed_and_broken_off_by_an_approver(served: Any) -> None:
    with ThreadPoolExecutor(1) as aside:
        answer, ticket = asked(served, aside, "viewer", "sql", json={"query": ENDLESS, "limit": None})
        try:
            page, _ = page_of(served, "engineer")
            # Cut after so many letters, and without what nobody set.
            assert f"sql query {ENDLESS[:74]}…, asked by a program of viewer-1" in page
            assert 'action="/work/cancel"' not in page
            page, proof = page_of(served, "approver")
            form = {"proof": proof, "number": str(ticket.number)}
            taken = served.client.post("/work/cancel", data=form)
            assert (taken.status_code, taken.headers["location"]) == (303, "/work")
        finally:
            ticket.take_back("the test")
        refused = answer.result(60.0)
    assert refused.status_code == 409
    assert refused.json()["error"].startswith("this was taken back by")
    assert "what was not finished is not stored" in refused.json()["error"]
    assert "Nothing." in page_of(served, "approver")[0]


def test_an_import_of_a_program_says_what_went_in_and_what_did_not(
    served: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    stored, free = threading.Event(), threading.Event()
    store = importing.import_campaign

    def stored_then_held(*arguments: Any) -> Any:
        imported = store(*arguments)
        stored.set()
        assert free.wait(60.0)
        return imported

    monkeypatch.setattr(importing, "import_campaign", stored_then_held)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name in ("cold-cold", "nothing-hidden"):
            for path in sorted((EXAMPLES / name).iterdir()):
                archive.write(path, f"{name}/{path.name}")
    with ThreadPoolExecutor(1) as aside:
        files = {"file": ("two.zip", packed.getvalue())}
        answer, ticket = asked(served, aside, "engineer", "import", files=files)
        try:
            assert stored.wait(60.0)
            page, proof = page_of(served, "engineer")
            assert "import of 2 folders: cold-cold, nothing-hidden, asked by a program of engineer-1" in page
            # It has no page of its own: whoever asked reads it in the answer.
            assert "/import/under-way" not in page
            form = {"proof": proof, "number": str(ticket.number)}
            assert served.client.post("/work/cancel", data=form).headers["location"] == "/work"
        finally:
            free.set()
        refused = answer.result(60.0)
    assert (refused.status_code, refused.json()["error"]) == (
        409,
        "this was taken back by engineer-1 before it was answered: cold-cold went in and stays, nothing-hidden did not",
    )
    campaigns = served.ask("campaigns", role="viewer")[1]["campaigns"]
    assert [row["campaign"] for row in campaigns] == ["cold-cold"]


def test_a_long_document_is_cut_in_the_list() -> None:
    document = {f"key{number}": "x" * 10_000 for number in range(100)} | {"none": None, "no": False}
    text = asked_for(Ticket(1, "sql", document, User("ada", Role.VIEWER)))
    assert text.startswith(f"sql key0 {'x' * 75}… key1 x")
    assert len(text) < 1100
    assert asked_for(
        Ticket(1, "identify", {"run": 0, "none": None, "no": False}, User("ada", Role.VIEWER))
    ) == ("identify run 0")
