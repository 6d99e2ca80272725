"""What a server that runs for weeks lets go of: answers that no question is answered by any more."""

from __future__ import annotations

import gc
import weakref
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from monitor.cli import garbage
from monitor.cli.verbs import serve_
from monitor.web import server
from monitor.web.desk import Desk
from monitor.web.freshness import Freshness
from monitor.web.users import Role, User

ANYBODY = User("somebody", Role.APPROVER)


class Answering:
    """Answers every question by an object of its own."""

    def __init__(self) -> None:
        self.freshness = Freshness()

    def __call__(self, *_: object) -> Any:
        return SimpleNamespace()


def test_an_answer_is_held_in_place_of_the_one_before_a_write() -> None:
    freshness = Freshness()
    document = {"machine": "MILL-1"}
    for number in range(1, 6):
        key, answer = freshness.recall("values", document)
        assert answer is None
        freshness.remember(key, number)
        assert freshness.recall("values", document)[1] == number
        freshness.wrote(None)
    assert len(freshness._answers) == 1
    # An answer that was computed while somebody wrote holds for the time before.
    before, _ = freshness.recall("values", document)
    freshness.wrote(None)
    freshness.remember(before, "late")
    assert freshness.recall("values", document)[1] is None


def test_tickets_from_before_a_write_are_forgotten_and_die_without_the_collector() -> None:
    asker = Answering()
    desk = Desk(asker)  # type: ignore[arg-type]
    asked = []
    gc.disable()
    try:
        for _ in range(20):
            ticket = desk.ask(ANYBODY, "trend", {"machine": "MILL-1"})
            ticket.future.result()
            asked.append(weakref.ref(ticket))
            asker.freshness.wrote(None)
        del ticket
        desk.close()
        assert len(desk._tickets) <= 2
        # The last one, the one that was answered last, and one whose answer was being noted.
        assert sum(reference() is not None for reference in asked) <= 3
    finally:
        gc.enable()


def test_a_server_looks_for_cycles_as_often_as_python_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = gc.get_threshold()
    served: list[tuple[int, int, int]] = []
    monkeypatch.setattr(server, "serve", lambda *_: served.append(gc.get_threshold()))
    options = SimpleNamespace(
        add_user=None, db=tmp_path / "shop.duckdb", host="127.0.0.1", port=0, users=None, certificate=None, key=None,
        behind_proxy=None, read_only=False,
    )  # fmt: skip
    try:
        garbage.collect_rarely()
        assert gc.get_threshold()[0] > usual[0]
        serve_.run(options)  # type: ignore[arg-type]
    finally:
        gc.set_threshold(*usual)
    assert served == [usual]
