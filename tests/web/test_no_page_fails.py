"""No address and no form of the pages is answered by a server error, whatever is stored and whatever is asked.

The databases: an empty one, one of curves, instruments and a machine with an event alone, never identified, and one
whose machines nobody described, as other programs write it.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from monitor.store import Database, list_campaigns, withdraw_campaign
from monitor.workflow.events import EventRequest, event
from monitor.workflow.intake.importing import ImportRequest, import_folders
from tests.benchmarks.test_fleet import generate
from tests.web.test_names_on_pages import names_on

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
#: Campaigns of every method of machines; of samba the tests beside this one ask.
BY_METHOD = (
    "r-test", "four-instruments", "l-shape", "tilting-table-compensated", "tracked-robot", "free-form-pins",
)  # fmt: skip
NASTY = ("none", "9" * 30, "\0", "", "9999-12-31", "<b>'\"%")
#: What an address or a form needs beside campaign and machine to get as far as it can.
USUAL = {
    "parameter": "EXX", "effect": "EXX:const", "number": "1", "why": "none", "week": "2026-W10", "format": "csv",
    "since_1": "2026-01-01", "until_1": "2026-01-02", "since_2": "2026-01-03", "until_2": "2026-01-04",
}  # fmt: skip
#: What each form sends that is looked at; a new form has to be written down here.
FORMS = {
    "/campaign/withdraw": {"reason": "x", "typed": "x"},
    "/certificate/new": {
        "button": "issue", "run": "1", "replaces": "", "reason": "x", "method": "guf", "issued_on": "2026-01-01",
        "conformity": "simple", "number": "1", "customer.name": "x", "laboratory.language": "en",
    },
    "/certificates/verify": {},
    "/certificates/withdraw": {"number": "1", "reason": "x"},
    "/fleet/identify": {},
    "/import": {"button": "look"},
    "/login": {"name": "ada", "token": "guessed", "then": "/", "typed": "x"},
    "/logout": {},
    "/machine/event": {"text": "x", "at": "2026-01-01T00:00:00Z", "kind": "crash"},
    "/machine/event/withdraw": {"number": "1", "reason": "x"},
    "/model/add": {"effect": "EXX:const", "to": "instruments", "new_name": "", "note": "", "latest": ""},
    "/model/undo": {"effect": "EXX:const", "model": "instruments", "latest": ""},
    "/work/again": {"number": "1", "then": "/"},
    "/work/cancel": {"number": "1"},
}  # fmt: skip


def _routes(application: Any) -> Iterator[Any]:
    """Every route, those of included routers too."""
    for route in application.routes:
        inner = getattr(route, "original_router", None) or getattr(route, "app", None)
        for part in getattr(inner, "routes", [route]):
            if not part.path.startswith(("/static/", "/api/")):
                yield part


def _addresses(application: Any) -> dict[str, list[str]]:
    """The names in the query of every address that is looked at."""
    looked_at = [route for route in _routes(application) if "GET" in route.methods]
    return {route.path: [field.alias for field in route.dependant.query_params] for route in looked_at}


def _query(path: str, names: list[str], machine: str, campaign: str) -> dict[str, str]:
    named = {"campaign": campaign, "name": campaign if path == "/campaign" else machine}
    wanted = ("campaign", "name") if path not in ("/machine", "/machine/parameters") else ("name",)
    return {name: named[name] for name in names if name in wanted} | {
        name: USUAL[name]
        for name in names
        # The machine's page chooses a parameter itself.
        if name in USUAL and not (path == "/machine" and name == "parameter")
    }


def _looked_at(served: Any, path: str, query: dict[str, str]) -> Any:
    """The answer once nothing of it is being computed any more."""
    while True:
        answer = served.client.get(path, params=query or None)
        if answer.status_code == 202 or 'class="waiting"' in answer.text:
            time.sleep(0.05)
            continue
        return answer


def _small(path: Path) -> None:
    with Database(path, threads=1) as db:
        names = ("r-test", "load-cell", "tilting-table-compensated")
        import_folders(db, ImportRequest([EXAMPLES / name for name in names]))
        event(db, EventRequest("TILT-500", "came in", datetime(2026, 1, 1, tzinfo=UTC)))
        withdraw_campaign(db, names[-1], "of a machine of which an event is left alone")


def _undescribed(path: Path) -> None:
    with Database(path, threads=1) as db:
        generate(db, 2, 3)


#: How a database is made, the names of a machine and of a campaign in it, and what else is asked of it.
STORED: dict[str, tuple[Any, str, str, tuple[str, ...]]] = {
    "empty": (lambda path: None, "M1", "none", ()),
    "small": (_small, "CENTRE-4", "r-test", NASTY),
    "curve": (_small, "TILT-500", "load-cell", ()),
    "undescribed": (_undescribed, "M00001", "M00001-W2", ()),
}


@pytest.fixture(scope="module", params=STORED)
def stored(
    request: Any, serve: Any, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Any, str, str, tuple[str, ...]]:
    """A server, the names of a machine and of a campaign in its database, and what else is asked of it."""
    path = tmp_path_factory.mktemp("stored") / "monitor.duckdb"
    make, machine, campaign, nasty = STORED[request.param]
    make(path)
    return serve(path, False), machine, campaign, nasty


@pytest.mark.slow
def test_no_address_is_answered_by_a_server_error(stored: tuple[Any, str, str, tuple[str, ...]]) -> None:
    served, machine, campaign, nasty = stored
    failed = []
    for path, names in _addresses(served.client.app._app).items():
        usual = _query(path, names, machine, campaign)
        changed = [usual | {name: value} for name in names for value in nasty]
        for query in (usual, {}, *changed):
            answer = _looked_at(served, path, query)
            if answer.status_code >= 500:
                failed.append((path, query))
    assert failed == []


@pytest.mark.slow
def test_no_form_is_answered_by_a_server_error(stored: tuple[Any, str, str, tuple[str, ...]]) -> None:
    served, machine, campaign, nasty = stored
    assert {route.path for route in _routes(served.client.app._app) if "POST" in route.methods} == set(FORMS)
    failed = []
    for path, fields in FORMS.items():
        usual = {**fields, "machine": machine, "campaign": campaign}
        changed = [usual | {name: value} for name in usual for value in nasty[:4]] if fields else []
        proof = served.proof()
        for number, sent in enumerate(({}, usual, *changed)):
            answer = served.client.post(path, data={**sent, "proof": proof, "once": f"{path} {number}"})
            if answer.status_code == 303:
                answer = _looked_at(served, answer.headers["location"], {})
            if answer.status_code >= 500:
                failed.append((path, sent))
    assert failed == []


@pytest.mark.slow
@pytest.mark.parametrize("name", BY_METHOD)
def test_no_page_of_a_campaign_of_any_method_fails(name: str, serve: Any, tmp_path: Path) -> None:
    """Never identified before; every page of it and of its machine, to the end of what it computes."""
    path = tmp_path / "monitor.duckdb"
    with Database(path, threads=1) as db:
        (imported,) = import_folders(db, ImportRequest([EXAMPLES / name])).imported
        machine = list_campaigns(db, campaign=imported.campaign)[0].machine
    served = serve(path, False)
    pages = []
    for address, names in _addresses(served.client.app._app).items():
        answer = _looked_at(served, address, _query(address, names, machine, imported.campaign))
        assert answer.status_code < 500, address
        pages.append(answer.text)
    # Five kinds of chains: each of its parameters has one name on all pages.
    assert {symbol: words for symbol, words in names_on(pages).items() if len(words) > 1} == {}
