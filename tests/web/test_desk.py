"""What is computed for many who ask at once: an answer that rests while others import, quick questions first."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

pytest.importorskip("fastapi", reason="the extra web is not installed")

from monitor.exceptions import BusyError, InputError, NotFoundError
from monitor.progress import saying, told
from monitor.web import ticket as ticket_module
from monitor.web.desk import Desk
from monitor.web.freshness import Freshness
from monitor.web.users import Role, User
from monitor.web.words import so_far

ADA = User("ada", Role.ENGINEER)
SUMS = ("fleet", {"top": 0})


class _Asked:
    """Answers every question with how often it was asked, once ``go`` is set; refuses while ``refuses``."""

    def __init__(self) -> None:
        self.freshness, self.go, self.count, self.refuses = Freshness(), threading.Event(), 0, False
        self.fault: Exception | None = None

    def follow(self) -> None:
        """Have one file, and no copies of it."""

    def __call__(self, user: User, question: str, document: Any, files: Any = None) -> int:
        self.go.wait(60.0)
        if self.fault is not None:
            raise self.fault
        if self.refuses:
            raise NotFoundError("nothing was identified")
        self.count += 1
        return self.count


@pytest.fixture
def asked() -> Iterator[tuple[Desk, _Asked]]:
    asker = _Asked()
    desk = Desk(asker)  # type: ignore[arg-type]
    yield desk, asker
    asker.go.set()
    desk.close()


def test_an_answer_rests_while_others_import_and_is_shown_while_the_next_is_computed(
    asked: tuple[Desk, _Asked],
) -> None:
    desk, asker = asked
    asker.go.set()
    first, before = desk.ask_rested(ADA, *SUMS)
    assert first.answer(60.0) == 1
    assert before is None
    # Nothing was written: it is the same.
    assert desk.ask_rested(ADA, *SUMS) == (first, first)
    # An import, a moment later: the answer stands, and is known not to be of now.
    first.took_s = 1e6
    asker.freshness.wrote({"M1"})
    assert desk.ask_rested(ADA, *SUMS) == (first, first)
    assert desk.standing(*SUMS) is None
    # After it has rested it is computed anew, and shown until then.
    first.took_s = 0.0
    asker.go.clear()
    second, before = desk.ask_rested(ADA, *SUMS)
    assert second.number > first.number
    assert before is first
    assert second.answer(0.0) is None
    asker.go.set()
    assert second.answer(60.0) == 2
    assert desk.answered_last(*SUMS) is second
    # What is no import is seen at once: an identification, an event, a withdrawal.
    for write in (asker.freshness.identified, lambda: asker.freshness.wrote(None)):
        last = desk.answered_last(*SUMS)
        assert last is not None
        last.took_s = 1e6
        write()
        ticket, _ = desk.ask_rested(ADA, *SUMS)
        assert ticket is not last
        ticket.future.result(60.0)


def test_nothing_rests_longer_than_a_minute_and_a_refusal_not_at_all(asked: tuple[Desk, _Asked]) -> None:
    desk, asker = asked
    asker.go.set()
    ticket, _ = desk.ask_rested(ADA, *SUMS)
    ticket.future.result(60.0)
    ticket.took_s = 100.0
    ticket.asked_at -= 100.0 + ticket_module.LONGEST_REST_S - 5.0
    assert not ticket.is_rested
    ticket.asked_at -= 10.0
    assert ticket.is_rested
    asker.freshness.wrote(None)
    asker.refuses = True
    refused, before = desk.ask_rested(ADA, *SUMS)
    with pytest.raises(NotFoundError, match="nothing was identified"):
        refused.answer(60.0)
    assert before is ticket
    assert desk.answered_last(*SUMS) is ticket


def test_a_refusal_stands_until_something_is_written_or_a_minute_went_by(asked: tuple[Desk, _Asked]) -> None:
    """A page that asks two questions which are refused later than it waits was never complete."""
    desk, asker = asked
    asker.refuses = True
    asker.go.set()
    questions = [("residuals", {"campaign": "c"}), ("residuals by driver", {"campaign": "c"})]
    for _ in range(3):
        tickets = [desk.ask(ADA, *question) for question in questions]
        for ticket in tickets:
            with pytest.raises(NotFoundError, match="nothing was identified"):
                ticket.answer(60.0)
    assert tickets[1].number == tickets[0].number + 1
    tickets[0].asked_at -= ticket_module.REFUSAL_STANDS_S + 5.0
    third = desk.ask(ADA, *questions[0])
    assert third.number == tickets[1].number + 1
    third.future.exception(60.0)
    asker.refuses = False
    asker.freshness.wrote(None)
    assert desk.ask(ADA, *questions[1]).answer(60.0) == 1


def test_a_fault_stands_for_a_moment_and_is_asked_anew(
    asked: tuple[Desk, _Asked], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A page that waits is loaded again when it ends, and has to find it."""
    desk, asker = asked
    asker.go.set()
    for fault in (BusyError("another process writes"), ZeroDivisionError("a fault of the software")):
        asker.fault = fault
        ticket = desk.ask(ADA, "compare", {"campaign": "c"})
        with pytest.raises(type(fault), match=str(fault)):
            ticket.answer(60.0)
        asker.fault = None
        assert desk.ask(ADA, "compare", {"campaign": "c"}) is ticket
        with monkeypatch.context() as later:
            later.setattr(ticket_module, "FAULT_STANDS_S", -60.0)
            again = desk.ask(ADA, "compare", {"campaign": "c"})
        assert again is not ticket
        assert again.answer(60.0)
        asker.freshness.wrote(None)


def test_who_asks_anew_is_not_told_the_refusal_that_stands(asked: tuple[Desk, _Asked]) -> None:
    desk, asker = asked
    asker.go.set()
    asker.fault = InputError("there is nothing to identify")
    refused = desk.ask(ADA, "identify", {"campaign": "c"})
    with pytest.raises(InputError, match="nothing to identify"):
        refused.answer(60.0)
    asker.fault = None
    assert desk.ask(ADA, "identify", {"campaign": "c"}) is refused
    again = desk.ask(ADA, "identify", {"campaign": "c"}, anew=True)
    assert again is not refused
    assert again.answer(60.0)


def test_the_trend_that_somebody_looks_at_does_not_wait_behind_long_questions(
    asked: tuple[Desk, _Asked],
) -> None:
    desk, _ = asked
    with ThreadPoolExecutor(1) as aside:
        for name in "abc":
            desk.ask(ADA, "explain", {"campaign": name})
        waiting = desk.ask(ADA, "trend", {"machine": "M1"})
        quick = desk.ask(ADA, "trend", {"machine": "M1", "parameter": "EXX"})
        begun = aside.submit(lambda: next(iter(filter(None, iter(lambda: quick.is_running, None)))))
        assert begun.result(60.0)
        assert not waiting.is_running


def test_what_is_computed_says_how_far_it_is() -> None:
    told_to, go = threading.Event(), threading.Event()

    class Telling:
        freshness = Freshness()

        def follow(self) -> None:
            """Have one file, and no copies of it."""

        def __call__(self, *_: object) -> str:
            told(0.25)
            told(0.4)
            told_to.set()
            assert go.wait(60.0)
            return "answer"

    desk = Desk(Telling())  # type: ignore[arg-type]
    try:
        ticket = desk.ask(ADA, *SUMS)
        assert told_to.wait(60.0)
        assert re.fullmatch(r"\d+ seconds? so far, about 40 % done", so_far(ticket))
        go.set()
        assert ticket.answer(60.0) == "answer"
        # Where nothing is told nothing is said: what another thread tells is not this work's.
        told(0.9)
        assert ticket.shares == [0.4]
    finally:
        go.set()
        desk.close()


def test_a_page_says_what_is_done_where_nobody_knows_how_far_it_is() -> None:
    begun, end = threading.Event(), threading.Event()

    class Compiling(_Asked):
        def follow(self) -> None:
            """Have one file, and no copies of it."""

        def __call__(self, user: User, question: str, document: Any, files: Any = None) -> int:
            with saying("the program is being made ready"):
                begun.set()
                end.wait(60.0)
            return 1

    desk = Desk(Compiling())  # type: ignore[arg-type]
    ticket = desk.ask(ADA, *SUMS)
    assert begun.wait(60.0)
    assert re.fullmatch(r"\d+ seconds? so far; the program is being made ready", so_far(ticket))
    end.set()
    assert ticket.answer(60.0) == 1
    assert "made ready" not in so_far(ticket)
    desk.close()
