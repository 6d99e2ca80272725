"""Every route, of the pages and of the interface: nobody without a proof of who it is, nobody beyond the role."""

from __future__ import annotations

from typing import Any

import pytest

from monitor.web.access import NOT_OFFERED, address_of, offered, role_needed
from monitor.web.gate import PUBLIC
from monitor.web.users import ROLES, Role

#: Every form of the pages with the lowest role that may send it; a new one has to be written down here.
FORMS = {
    "/import": Role.ENGINEER,
    "/fleet/identify": Role.ENGINEER,
    "/machine/event": Role.ENGINEER,
    "/machine/event/withdraw": Role.ENGINEER,
    "/campaign/withdraw": Role.APPROVER,
    "/model/add": Role.ENGINEER,
    "/model/undo": Role.ENGINEER,
    "/work/cancel": Role.VIEWER,
    "/work/again": Role.VIEWER,
    "/certificate/new": Role.APPROVER,
    "/certificates/withdraw": Role.APPROVER,
    "/certificates/verify": Role.VIEWER,
    "/logout": Role.VIEWER,
}
FIELDS = {
    "machine": "HU40-T", "text": "x", "campaign": "nowhere", "effect": "EXX:const", "to": "samba", "model": "samba",
    "number": "1", "reason": "x", "at": "2026-01-01T00:00:00+00:00",
}  # fmt: skip


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory, serve: Any) -> Any:
    return serve(tmp_path_factory.mktemp("roles") / "monitor.duckdb", True)


def _routes(application: Any) -> set[tuple[str, str]]:
    """Method and path of every route."""
    routes = set()
    for route in application.routes:
        inner = getattr(route, "original_router", None) or getattr(route, "app", None)
        for part in getattr(inner, "routes", [route]):
            routes |= {(method, getattr(part, "path", "")) for method in getattr(part, "methods", None) or ()}
    return routes - {("HEAD", path) for _, path in routes}


def test_the_list_of_forms_is_that_of_the_server(guarded: Any) -> None:
    posted = {path for method, path in _routes(guarded.client.app._app) if method == "POST"}
    assert posted == {*FORMS, "/login", *(address_of(name) for name in offered())}
    assert {method for method, _ in _routes(guarded.client.app._app)} == {"GET", "POST"}


def test_no_route_answers_somebody_unknown(guarded: Any) -> None:
    guarded.client.cookies.clear()
    for method, path in sorted(_routes(guarded.client.app._app)):
        if path in PUBLIC or path.startswith("/static/"):
            continue
        for headers in ({}, {"Authorization": "Bearer "}, {"Cookie": "monitor_session=guessed"}):
            answer = guarded.client.request(method, path, headers=headers, content=b"{}")
            assert answer.status_code == (401 if path.startswith("/api/") else 303), (method, path)
            assert "set-cookie" not in answer.headers


@pytest.mark.parametrize("role", ROLES)
def test_every_question_asks_for_its_role_and_no_higher(guarded: Any, role: str) -> None:
    # A field that no question has: whoever may ask is told so, before anything is done.
    for name in offered():
        needed = role_needed(name)
        headers = {"Authorization": f"Bearer {guarded.tokens[role]}", "Content-Type": "application/json"}
        answer = guarded.client.post(address_of(name), json={"nonsense": 1}, headers=headers)
        assert answer.status_code == (400 if ROLES[role] >= needed else 403), (name, answer.text)
    for name in NOT_OFFERED:
        headers = {"Authorization": f"Bearer {guarded.tokens[role]}"}
        assert guarded.client.post(address_of(name), json={}, headers=headers).status_code == 404


@pytest.mark.parametrize("role", ROLES)
def test_every_form_asks_for_its_role(guarded: Any, role: str) -> None:
    guarded.client.cookies.clear()
    guarded.client.post("/login", data={"token": guarded.tokens[role]})
    before = guarded.db.rows("SELECT count(*) FROM audit")
    for path, needed in FORMS.items():
        if path == "/logout" or ROLES[role] >= needed:
            continue
        answer = guarded.client.post(path, data={"proof": guarded.proof("/"), **FIELDS})
        assert answer.status_code == 403, path
        assert f"needs the role {needed.word}" in answer.text
    assert guarded.db.rows("SELECT count(*) FROM audit") == before


def test_what_changes_something_needs_more_than_looking() -> None:
    """Written down a second time, by hand: what a viewer must never be able to do."""
    for name in ("import", "event", "add effect", "remove effect", "use model", "select", "identify all"):
        assert role_needed(name) is Role.ENGINEER
    for name in (
        "issue certificate", "amend certificate", "withdraw certificate", "withdraw campaign", "backup",
    ):  # fmt: skip
        assert role_needed(name) is Role.APPROVER
