"""A form that is sent after the log-in has ended: what was typed is held, and sent after the next log-in."""

from __future__ import annotations

import html
import re
from typing import Any

import pytest

from monitor.web.forms import Typed
from monitor.web.gate import DOCUMENT_BYTES

TYPED = 'belt <changed>\n\n"twice" & checked'
FIELDS = {"machine": "HU40-T", "text": TYPED, "kind": "repair", "at": "2026-03-01T07:00:00Z"}


@pytest.fixture(scope="module")
def guarded(imported: Any, tmp_path_factory: pytest.TempPathFactory, serve: Any) -> Any:
    copy = tmp_path_factory.mktemp("late") / "monitor.duckdb"
    copy.write_bytes(imported.read_bytes())
    return serve(copy, True)


@pytest.fixture
def engineer(guarded: Any) -> Any:
    """A server whose client is logged in as an engineer."""
    guarded.client.cookies.clear()
    guarded.client.post("/login", data={"token": guarded.tokens["engineer"]})
    return guarded


def _areas(page: str) -> dict[str, str]:
    """Fields and text areas of a page as a browser sends them: the line break after a tag is none of the text."""
    areas = re.findall(r'<textarea name="([^"]+)"[^>]*>\n?(.*?)</textarea>', page, re.S)
    inputs = re.findall(r'<input type="hidden" name="([^"]+)" value="([^"]*)"', page)
    return {name: html.unescape(text) for name, text in [*areas, *inputs]}


def test_what_was_typed_is_held_over_the_log_in(engineer: Any) -> None:
    client = engineer.client
    form = {**FIELDS, "proof": engineer.proof()}
    client.cookies.clear()
    late = client.post(
        "/machine/event", data=form, headers={"Referer": "http://127.0.0.1:8765/machine?name=HU40-T"}
    )
    assert late.status_code == 401
    assert "Your log-in has ended, so nothing was done. Log in again: what you filled in is held" in late.text
    held = _areas(late.text)
    wrong = client.post("/login", data={**held, "token": "guessed"})
    assert wrong.status_code == 403
    assert _areas(wrong.text)["typed"] == held["typed"]
    again = client.post("/login", data={**held, "token": engineer.tokens["engineer"]})
    assert again.status_code == 200
    assert "You are logged in again. Nothing was done yet." in again.text
    assert engineer.db.rows("SELECT count(*) FROM event") == [(0,)]
    filled = _areas(again.text)
    assert {name: filled[name] for name in FIELDS} == FIELDS
    assert client.post("/machine/event", data=filled).status_code == 303
    assert engineer.db.rows("SELECT description FROM event") == [(TYPED,)]


def test_a_form_of_another_session_is_sent_again_by_whoever_looks_at_it(engineer: Any) -> None:
    stale = engineer.client.post("/machine/event", data={**FIELDS, "text": "later", "proof": "0" * 64})
    assert stale.status_code == 403
    assert "This form is too old, or not one of this server&#39;s pages: nothing was done" in stale.text
    before = engineer.db.rows("SELECT count(*) FROM event")
    assert engineer.client.post("/machine/event", data=_areas(stale.text)).status_code == 303
    assert engineer.db.rows("SELECT count(*) FROM event") == [(before[0][0] + 1,)]


@pytest.mark.parametrize("size", [10, DOCUMENT_BYTES + 1])
def test_files_are_chosen_again(engineer: Any, size: int) -> None:
    engineer.client.cookies.clear()
    files = [("file", ("campaign.zip", b"x" * size))]
    late = engineer.client.post("/import", data={"proof": "old"}, files=files)
    assert late.status_code == 401
    assert "files have to be chosen again" in late.text
    held = _areas(late.text)
    again = engineer.client.post(
        "/login",
        data={**held, "token": engineer.tokens["engineer"]},
        headers={"Referer": "http://127.0.0.1:8765/login"},
    )
    assert "choose them again on their page" in again.text
    assert "send it" not in again.text.partition("<h1>")[2].partition("</h1>")[2]


def test_an_address_is_whole_after_the_log_in(engineer: Any) -> None:
    engineer.client.cookies.clear()
    sent = engineer.client.get("/machine?name=HU40-T&parameter=EB0C")
    assert sent.status_code == 303
    login = engineer.client.get(sent.headers["location"])
    fields = {**_areas(login.text), "token": engineer.tokens["viewer"]}
    assert (
        engineer.client.post("/login", data=fields).headers["location"]
        == "/machine?name=HU40-T&parameter=EB0C"
    )


@pytest.mark.parametrize("text", ["", "{}", '["/x"]', '["/x", [1], 0]', "[" * 100_000])
def test_what_is_no_form_is_no_form(text: str) -> None:
    assert Typed.of_document(text) is None


def test_a_form_is_sent_to_this_server_alone() -> None:
    typed = Typed.of_document('["//evil.example/x", [["a", "b"]], false]')
    assert typed == Typed("/", (("a", "b"),), False)
    assert Typed.of_document(Typed("/model/add", (("a", "\n b"),), True).document()) == Typed(
        "/model/add", (("a", "\n b"),), True
    )
