"""Long questions in threads of their own: a page waits a moment for the answer, else shows that it is being computed.

A question is the same for everybody who asks it, and its answer holds until something is written: a page that is loaded
again finds the work where it is.
"""

from __future__ import annotations

import json
import time
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from threading import RLock
from typing import Any, TypeVar

from monitor.exceptions import NotFoundError
from monitor.store import held_bytes
from monitor.web.asking import Asker, ForbiddenError, check_role
from monitor.web.faults import SERVER_END
from monitor.web.freshness import Stamp, differ_by_imports
from monitor.web.ticket import Ticket
from monitor.web.users import User

#: Two cores are the smallest machine that this runs on; answers of more at once only wait for each other.
WORKERS = 2
#: Answers that are held, and their bytes; the oldest is forgotten, and computed again when somebody asks. The one that
#: was answered last is held whatever its size: whoever opens its page again would wait as long.
MOST, MOST_BYTES = 200, 512_000_000

Key = TypeVar("Key")


class Desk:
    """Takes questions, computes two at a time, and holds what was answered."""

    def __init__(self, asker: Asker) -> None:
        self.asker = asker
        self._pool = ThreadPoolExecutor(WORKERS, thread_name_prefix="monitor-desk")
        # The trend of the one parameter that somebody looks at takes 0.1 s: it waits behind its like alone.
        self._quick = ThreadPoolExecutor(1, thread_name_prefix="monitor-quick")
        # Who writes does not wait behind what others compute.
        self._writers = ThreadPoolExecutor(WORKERS, thread_name_prefix="monitor-writer")
        self._written: OrderedDict[int, Ticket] = OrderedDict()
        self._of_programs: dict[int, Ticket] = {}
        self._tickets: dict[tuple[str, str, Stamp], Ticket] = {}
        self._answered_last: dict[tuple[str, str], Ticket] = {}
        # What is answered at once is noted by whoever asks, who holds it already.
        self._lock = RLock()
        # Numbers of an earlier server are smaller (ms since 1970): an address that was kept never shows other work.
        self._first = self._count = time.time_ns() // 1_000_000

    def ask(
        self, user: User, question: str, document: Mapping[str, Any], files: Mapping[str, Any] | None = None,
        *, anew: bool = False,
    ) -> Ticket:  # fmt: skip
        """Return the ticket of a question, a new one where nobody asked it since the last change.

        What was taken back stays so until ``ask_again``: a page that loads itself again does not start it; ``anew``
        does, and asks what was refused once more.
        ``files`` are paths that the server itself fills in; they are no part of what is asked.
        """
        check_role(user, question)
        self.asker.follow()
        key = self._key(question, document)
        with self._lock:
            ticket = self._tickets.get(key)
            if (
                ticket is not None
                and ticket.is_good
                and not (anew and (ticket.is_taken_back or ticket.is_refused))
            ):
                return ticket
            self._forget_outdated()
            ticket = self._tickets[key] = self._new(user, question, document, stamp=key[2])
            pool = self._quick if question == "trend" and document.get("parameter") else self._pool
            future = ticket.future = pool.submit(self._answered, ticket, files)
            # Handed over once: a ticket that its own future names for ever would wait for the garbage collector, which
            # rarely looks at what is old, with an answer of megabytes.
            noted = [ticket]
            future.add_done_callback(lambda future: self._note_answer(key[:2], noted.pop(), future))
            while len(self._tickets) > MOST:
                del self._tickets[next(iter(self._tickets))]
            return ticket

    def _forget_outdated(self) -> None:
        """Forget answers from before a write, which no question is answered by any more: they are megabytes each."""
        freshness = self.asker.freshness
        for key, ticket in list(self._tickets.items()):
            if ticket.future.done() and key[2] != freshness.stamp(ticket.question, ticket.document):
                del self._tickets[key]

    def ask_rested(
        self, user: User, question: str, document: Mapping[str, Any]
    ) -> tuple[Ticket, Ticket | None]:
        """Return the ticket of a question, and the one that was answered last (None where none was).

        Where only imports came since, and it stood for less than ``REST`` times as long as it took, the two are the
        same: an answer that is a little old, and nothing is computed.
        """
        last = self.answered_last(question, document)
        if last is not None and not last.is_rested:
            check_role(user, question)
            if differ_by_imports(last.stamp, self.asker.freshness.stamp(question, document)):
                return last, last
        return self.ask(user, question, document), last

    def answered_last(self, question: str, document: Mapping[str, Any]) -> Ticket | None:
        """Return the ticket of a question that was answered last, whatever was written since; None where none was."""
        with self._lock:
            return self._answered_last.get(self._key(question, document)[:2])

    def _note_answer(self, asked: tuple[str, str], ticket: Ticket, future: Future[Any]) -> None:
        """Keep what was answered last, with how long that took; waiting for others is counted too."""
        ticket.took_s = ticket.seconds
        if future.cancelled() or future.exception() is not None:
            return
        ticket.bytes = held_bytes(future.result())
        with self._lock:
            # The one that was answered last is the last one of its kind.
            self._answered_last.pop(asked, None)
            self._answered_last[asked] = ticket
            while len(self._answered_last) > MOST:
                del self._answered_last[next(iter(self._answered_last))]
            self._forget_beyond_bytes(ticket)

    def _forget_beyond_bytes(self, latest: Ticket) -> None:
        """Forget the oldest answers until the rest holds no more than ``MOST_BYTES``: those of before a write first."""
        held = {
            id(ticket): ticket.bytes for ticket in (*self._tickets.values(), *self._answered_last.values())
        }
        total = sum(held.values())
        standing = {id(ticket) for ticket in self._tickets.values()}
        oldest = sorted(
            self._answered_last.values(), key=lambda ticket: (id(ticket) in standing, ticket.number)
        )
        for ticket in (*oldest, *self._tickets.values()):
            if total <= MOST_BYTES:
                return
            if ticket is not latest and ticket.future.done():
                total -= held.pop(id(ticket), 0)
                self._answered_last = _without(self._answered_last, ticket)
                self._tickets = _without(self._tickets, ticket)

    def begin(
        self,
        user: User,
        question: str,
        subject: Mapping[str, Any],
        work: Callable[[Callable[[str], None]], Any],
    ) -> Ticket:
        """Return the ticket of work that is this user's alone, such as an import; ``work`` tells what it is at."""
        check_role(user, question)
        with self._lock:
            ticket = self._new(user, question, subject)
            self._written[ticket.number] = ticket

            def followed() -> Any:
                with ticket.followed():
                    return work(ticket.said.append)

            ticket.future = self._writers.submit(followed)
            while len(self._written) > MOST:
                self._written.popitem(last=False)
            return ticket

    @contextmanager
    def of_program(self, user: User, question: str, document: Mapping[str, Any]) -> Iterator[Ticket]:
        """Yield the ticket of a question that this thread answers in the block, which ends by StoppedError where it is
        taken back."""
        with self._lock:
            ticket = self._new(user, question, document, is_of_program=True)
            self._of_programs[ticket.number] = ticket
        ticket.future.set_running_or_notify_cancel()
        try:
            with ticket.followed():
                yield ticket
        finally:
            ticket.future.set_result(None)
            with self._lock:
                del self._of_programs[ticket.number]

    def _new(self, user: User, question: str, document: Mapping[str, Any], **more: Any) -> Ticket:
        self._count += 1
        return Ticket(self._count, question, document, user, **more)

    def begun(self, user: User, number: int) -> Ticket:
        """Return the ticket of work that was begun. Raises NotFoundError for one that is gone or somebody else's."""
        if number < self._first:
            raise NotFoundError(
                "the server was started anew since, and what was under way then was cut off; what went in before "
                "stands in the list of the page Campaigns"
            )
        with self._lock:
            ticket = self._written.get(number)
        if ticket is None or not ticket.may_be_taken_back_by(user):
            raise NotFoundError(
                "this is not known any more, or was begun by somebody else; the page Campaigns lists what was imported"
            )
        return ticket

    def begun_by(self, user: User) -> list[Ticket]:
        """Return the work that was begun and that this user may see, the latest first."""
        with self._lock:
            written = list(self._written.values())
        return [ticket for ticket in reversed(written) if ticket.may_be_taken_back_by(user)]

    def standing(self, question: str, document: Mapping[str, Any]) -> Ticket | None:
        """Return the ticket of a question that was asked since the last change, None where nobody did; asks nothing."""
        with self._lock:
            ticket = self._tickets.get(self._key(question, document))
        return ticket if ticket is not None and ticket.is_good else None

    def _key(self, question: str, document: Mapping[str, Any]) -> tuple[str, str, Stamp]:
        return (
            question,
            json.dumps(document, sort_keys=True, default=str),
            self.asker.freshness.stamp(question, document),
        )

    def _answered(self, ticket: Ticket, files: Mapping[str, Any] | None) -> Any:
        with ticket.followed():
            return self.asker(ticket.user, ticket.question, ticket.document, files)

    def under_way(self) -> list[Ticket]:
        """Return what is not answered yet, in the order of asking."""
        with self._lock:
            every = [*self._tickets.values(), *self._written.values(), *self._of_programs.values()]
        return sorted(
            (ticket for ticket in every if not ticket.future.done()), key=lambda ticket: ticket.number
        )

    def take_back(self, user: User, number: int) -> Ticket:
        """Take back a question: one that waits at once, one that is being computed at its next checkpoint.

        Raises NotFoundError where it is answered already, ForbiddenError for whoever neither asked it nor approves.
        """
        ticket = next((ticket for ticket in self.under_way() if ticket.number == number), None)
        if ticket is None:
            raise NotFoundError("this is answered already, or was taken back: there is nothing to stop")
        if not ticket.may_be_taken_back_by(user):
            raise ForbiddenError(
                f"{ticket.user.name} asked this: {ticket.user.name} or an approver can take it back"
            )
        ticket.take_back(user.name)
        return ticket

    def ask_again(self, number: int) -> None:
        """Forget that a question was taken back: the next page that needs it asks it anew."""
        with self._lock:
            for key, ticket in list(self._tickets.items()):
                if ticket.number == number and ticket.is_taken_back:
                    del self._tickets[key]

    def end(self) -> list[Ticket]:
        """Take back all that is under way, what pages have done at once included, and return it; called again, also
        what came since."""
        self.asker.ending.set()
        unfinished = self.under_way()
        for ticket in unfinished:
            ticket.take_back(SERVER_END)
        return unfinished

    def close(self, *, waiting: bool = True) -> None:
        """Take back what waits; unless not ``waiting``, wait for what is being computed, so that nothing is left
        half."""
        for pool in (self._pool, self._quick, self._writers):
            pool.shutdown(wait=waiting, cancel_futures=True)


def _without(tickets: dict[Key, Ticket], forgotten: Ticket) -> dict[Key, Ticket]:
    return {key: ticket for key, ticket in tickets.items() if ticket is not forgotten}
