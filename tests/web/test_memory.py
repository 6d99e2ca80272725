"""What a server that runs for weeks lets go of: answers that no question is answered by any more."""

from __future__ import annotations

import gc
import tracemalloc
import weakref
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from monitor.cli import garbage
from monitor.cli.verbs import serve_
from monitor.store import held_bytes, recalling
from monitor.web import desk as desk_module, freshness as freshness_module, server
from monitor.web.desk import Desk
from monitor.web.freshness import Freshness
from monitor.web.users import Role, User
from monitor.workflow.fleet.answer import FleetTableRow

ANYBODY = User("somebody", Role.APPROVER)


class Answering:
    """Answers every question by an object of its own."""

    def __init__(self) -> None:
        self.freshness = Freshness()

    def follow(self) -> None:
        """Have one file, and no copies of it."""

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


def test_answers_are_held_within_a_number_of_bytes_and_the_latest_always(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(freshness_module, "_MOST_BYTES", 5_000_000)
    freshness = Freshness()
    for number in range(20):
        key, _ = freshness.recall("values", {"machine": f"MILL-{number}"})
        freshness.remember(key, (np.zeros(250_000),))
    assert [machine for _, machine in freshness._answers] == [f'{{"machine": "MILL-{n}"}}' for n in (18, 19)]
    # In place of the same one before, and larger than all that may be held.
    for _ in range(3):
        freshness.remember(freshness.recall("values", {"machine": "MILL-19"})[0], (np.zeros(1_000_000),))
    assert len(freshness._answers) == 1
    assert freshness.recall("values", {"machine": "MILL-19"})[1] is not None
    assert freshness._bytes == pytest.approx(8e6, rel=0.01)


class AnsweringMuch(Answering):
    def follow(self) -> None:
        """Have one file, and no copies of it."""

    def __call__(self, *_: object) -> Any:
        return (np.zeros(250_000),)


def test_the_answers_of_a_desk_are_held_within_a_number_of_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(desk_module, "MOST_BYTES", 7_000_000)
    desk = Desk(AnsweringMuch())  # type: ignore[arg-type]
    for number in range(12):
        desk.ask(ANYBODY, "trend", {"machine": f"MILL-{number}"}).future.result()
        if number == 5:
            # Those of before a write go first.
            desk.asker.freshness.wrote(None)
    desk.close()
    kept = {id(ticket): ticket for ticket in (*desk._tickets.values(), *desk._answered_last.values())}
    assert sorted(ticket.document["machine"] for ticket in kept.values()) == ["MILL-10", "MILL-11", "MILL-9"]
    assert desk.standing("trend", {"machine": "MILL-11"}) is not None
    assert desk.answered_last("trend", {"machine": "MILL-11"}) is not None


def test_what_is_recalled_of_a_file_is_held_within_a_number_of_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recalling, "MOST_BYTES", 5_000_000)
    recalled = recalling.Recalled()
    for number in range(10):
        recalled.answer(number, lambda: np.zeros(250_000))
    assert list(recalled._entries) == [8, 9]


@pytest.mark.parametrize(
    "make",
    [
        lambda: tuple(
            FleetTableRow(**{entry.name: f"{entry.name} {number}" for entry in fields(FleetTableRow)})
            for number in range(3000)
        ),
        lambda: {f"machine {n}": [f"EXX {n}", float(n), bytes(bytearray(100))] for n in range(20_000)},
        lambda: [np.arange(float(n)) for n in range(1, 1000)],
    ],
)
def test_the_bytes_of_an_answer_are_those_that_python_takes_for_it(make: Callable[[], Any]) -> None:
    assert held_bytes(make()) == pytest.approx(allocated(make), rel=0.2)


def test_what_parts_of_an_answer_share_is_counted_once() -> None:
    shared = np.zeros(1000)
    assert held_bytes((shared, {"again": shared})) == pytest.approx(8000, rel=0.1)


def allocated(make: Callable[[], Any]) -> int:
    """Return how many bytes Python allocates for what is made, by ``tracemalloc``."""
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        made = make()
        taken = tracemalloc.get_traced_memory()[0] - before
        assert made
        return taken
    finally:
        tracemalloc.stop()


def test_an_array_is_held_with_its_objects_its_mask_and_what_it_is_a_view_of() -> None:
    texts = np.array([f"{number:02d}" * 1000 for number in range(100)] + [None], dtype=object)
    assert held_bytes(texts) == pytest.approx(100 * 2049 + texts.nbytes, rel=0.1)
    numbers = np.zeros(1_000_000)
    assert held_bytes(np.ma.masked_array(numbers, mask=numbers > 0.0)) == pytest.approx(9e6, rel=0.05)
    assert held_bytes(numbers[:10]) == pytest.approx(8e6, rel=0.05)
