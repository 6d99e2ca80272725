"""Attacks on sessions, headers and addresses, as OWASP's testing guide lists them (WSTG-SESS-03, INPV-15, CLNT-04)."""

from __future__ import annotations

import re
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from monitor.web.forms import own_address
from monitor.web.sessions import COOKIE


@pytest.fixture
def guarded(imported: Path, serve: Any, tmp_path: Path) -> Any:
    copy = tmp_path / "guarded.duckdb"
    shutil.copyfile(imported, copy)
    return serve(copy, True)


def test_wstg_sess_03_a_planted_session_is_worth_nothing_after_the_log_in(guarded: Any) -> None:
    """Whoever plants a cookie before somebody logs in does not come in with it afterwards."""
    client = guarded.client
    planted = "A" * 43
    client.cookies.set(COOKIE, planted, domain="127.0.0.1")
    answer = client.post("/login", data={"token": guarded.tokens["approver"]})
    given = answer.headers["set-cookie"].partition(";")[0].partition("=")[2]
    assert given not in ("", planted)
    client.cookies.clear()
    client.cookies.set(COOKIE, planted, domain="127.0.0.1")
    assert client.get("/campaigns").headers["location"].startswith("/login")
    # A second log-in begins a session of its own, and log-out ends it.
    client.cookies.clear()
    again = client.post("/login", data={"token": guarded.tokens["approver"]})
    assert again.headers["set-cookie"].partition(";")[0].partition("=")[2] != given


@pytest.mark.parametrize(
    "address",
    ["//elsewhere", "/\\elsewhere", "https://elsewhere", "/\t/elsewhere", "/\n/elsewhere", "elsewhere", ""],
)
def test_wstg_clnt_04_nobody_is_sent_to_another_server(local: Any, address: str) -> None:
    assert own_address(address) == "/"
    fields = {"proof": local.proof(), "number": "1", "then": address or " "}
    answer = local.client.post("/work/again", data=fields)
    if answer.status_code == 303:
        assert re.fullmatch(r"/|/refused\?why=[\w-]+", answer.headers["location"])
    else:
        assert answer.status_code == 400  # an empty address


@pytest.mark.parametrize(
    "path",
    [
        "/machine/values.csv?name=HU40-T%0d%0aSet-Cookie:%20a=b",
        "/export?format=csv&machine=HU40-T%0d%0aSet-Cookie:%20a=b",
        "/report?week=2026-W10%0d%0aSet-Cookie:%20a=b",
        "/certificate.pdf?number=1%0d%0aSet-Cookie:%20a=b",
        "/login?then=/%0d%0aSet-Cookie:%20a=b",
    ],
)
def test_wstg_inpv_15_no_header_is_made_of_an_address(local: Any, path: str) -> None:
    answer = local.client.get(path)
    assert answer.status_code < 500
    assert "a=b" not in answer.headers.get("set-cookie", "")
    for name, text in answer.headers.items():
        assert "\r" not in name + text
        assert "\n" not in name + text


def test_two_who_send_the_same_form_at_once_do_it_once(guarded: Any) -> None:
    """Twenty at once: one event."""
    guarded.client.post("/login", data={"token": guarded.tokens["engineer"]})
    fields = {
        "proof": guarded.proof(), "once": "a", "machine": "HU40-T", "text": "belt", "kind": "repair",
        "at": "2026-03-01T07:00:00Z",
    }  # fmt: skip
    with ThreadPoolExecutor(20) as senders:
        answers = [
            sent.result()
            for sent in [
                senders.submit(guarded.client.post, "/machine/event", data=fields) for _ in range(20)
            ]
        ]
    assert {answer.status_code for answer in answers} == {303}
    assert guarded.db.rows("SELECT count(*) FROM event") == [(1,)]
