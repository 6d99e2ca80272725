"""Questions that are taken back: by whom, what is left of them, and what a page says then."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Event
from typing import Any

import pytest

pytest.importorskip("fastapi", reason="the extra web is not installed")
pytest.importorskip("plotly", reason="the extra web is not installed")

from monitor.exceptions import NotFoundError
from monitor.stopping import Stop, StoppedError, checkpoint, stoppable
from monitor.store import Database
from monitor.web.asking import ForbiddenError
from monitor.web.desk import Desk
from monitor.web.freshness import Freshness
from monitor.web.pages import machine, model
from monitor.web.ticket import Ticket
from monitor.web.users import Role, User

ADA, BOB, EVE = User("ada", Role.VIEWER), User("bob", Role.ENGINEER), User("eve", Role.APPROVER)


class Answering:
    """Answers every question by a function; the desk asks it as it asks the database."""

    def __init__(self, answer: Callable[[], Any]) -> None:
        self.freshness = Freshness()
        self.answer = answer
        self.count = 0

    def follow(self) -> None:
        """Have one file, and no copies of it."""

    def __call__(self, *_: object) -> Any:
        self.count += 1
        return self.answer()


def without_end() -> None:
    while True:
        checkpoint()
        time.sleep(0.001)


def awaited(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 120.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)


@pytest.fixture
def asker() -> Answering:
    return Answering(without_end)


@pytest.fixture
def desk(asker: Answering) -> Iterator[Desk]:
    desk = Desk(asker)  # type: ignore[arg-type]
    yield desk
    for ticket in desk.under_way():
        desk.take_back(EVE, ticket.number)
    desk.close()


@pytest.mark.parametrize("who", [ADA, EVE], ids=["who asked it", "an approver"])
def test_running_work_ends_and_stays_ended_until_it_is_asked_again(
    desk: Desk, asker: Answering, who: User
) -> None:
    ticket = desk.ask(ADA, "explain", {"campaign": "c"})
    awaited(lambda: ticket.is_running)
    with pytest.raises(ForbiddenError, match="ada asked this: ada or an approver can take it back"):
        desk.take_back(BOB, ticket.number)
    assert not ticket.stop.is_set()
    desk.take_back(who, ticket.number)
    awaited(lambda: ticket.is_taken_back)
    assert (ticket.answer(), ticket.is_done, ticket.taken_back_by) == (None, False, who.name)
    # A page that loads itself again meets it as it is.
    assert desk.ask(ADA, "explain", {"campaign": "c"}) is ticket
    assert asker.count == 1
    with pytest.raises(NotFoundError, match="answered already, or was taken back"):
        desk.take_back(who, ticket.number)
    desk.ask_again(ticket.number)
    again = desk.ask(ADA, "explain", {"campaign": "c"})
    assert again is not ticket
    assert desk.ask(BOB, "explain", {"campaign": "c"}) is again


def test_waiting_work_never_begins(desk: Desk, asker: Answering) -> None:
    running = [desk.ask(ADA, "explain", {"campaign": name}) for name in "ab"]
    awaited(lambda: all(ticket.is_running for ticket in running))
    waiting = desk.ask(BOB, "explain", {"campaign": "c"})
    desk.take_back(BOB, waiting.number)
    assert waiting.is_taken_back
    assert desk.ask(BOB, "explain", {"campaign": "c"}, anew=True) is not waiting
    assert asker.count == 2


def test_what_it_had_written_is_undone(tmp_path: Path) -> None:
    with Database(tmp_path / "monitor.duckdb", threads=1) as db:
        stop = Stop()

        def write() -> None:
            with db.transaction():
                db.execute("INSERT INTO tags VALUES ('half')")
                stop.set()
                db.rows("SELECT 1")

        db.execute("CREATE TABLE tags (name TEXT)")
        with stoppable(stop), pytest.raises(StoppedError, match="was taken back"):
            write()
        assert db.rows("SELECT count(*) FROM tags") == [(0,)]


def test_a_page_says_who_took_it_back_and_offers_to_compute_it(local: Any) -> None:
    desk: Desk = local.client.app._app.state.desk
    free = Event()
    busy = [desk._pool.submit(free.wait) for _ in range(2)]
    address = "/campaign?name=hidden-spindle-growth"
    try:
        assert "waiting for others" in local.client.get(address).text
        ticket: Ticket = next(ticket for ticket in desk.under_way() if ticket.question == "statistics")
        listed = local.client.get("/work").text
        assert "take it back" in listed
        form = {"proof": local.proof(), "number": str(ticket.number)}
        assert local.client.post("/work/cancel", data=form).status_code == 303
        page = local.client.get(address).text
        assert "statistics was taken back by" in page
        assert 'http-equiv="refresh"' not in page
        assert local.sent("/work/cancel", data=form).status_code == 404
        then = re.findall(r'name="then" value="([^"]*)"', page)[0]
        again = local.client.post("/work/again", data={**form, "then": then})
        assert (again.status_code, again.headers["location"]) == (303, address)
        away = local.client.post("/work/again", data={**form, "then": "//elsewhere.example"})
        assert away.headers["location"] == "/"
        assert "taken back" not in local.client.get(address).text
    finally:
        free.set()
    assert all(future.result(60.0) for future in busy)


@pytest.mark.parametrize(
    ("address", "question"),
    [
        ("/machine/parameters?name=HU40-T", "trend"),
        ("/model/explained?campaign=hidden-spindle-growth&effect=EXX:reversal", "residuals"),
    ],
)
def test_a_script_that_waits_for_what_was_taken_back_is_told_so(
    local: Any, address: str, question: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for page in (machine, model):
        monkeypatch.setattr(page, "FETCH_S", 0.0)
    desk: Desk = local.client.app._app.state.desk
    free = Event()
    busy = [desk._pool.submit(free.wait) for _ in range(2)]
    try:
        assert local.client.get(address).status_code == 202
        ticket: Ticket = next(ticket for ticket in desk.under_way() if ticket.question == question)
        local.client.post("/work/cancel", data={"proof": local.proof(), "number": str(ticket.number)})
        # Asked again and again it would be said to be computed for ever.
        assert local.client.get(address).status_code == 409
    finally:
        free.set()
    assert all(future.result(60.0) for future in busy)
