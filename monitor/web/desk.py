"""Long questions in threads of their own: a page waits a moment for the answer, else shows that it is being computed.

A question is the same for everybody who asks it, and its answer holds until something is written: a page that is loaded
again finds the work where it is.
"""

from __future__ import annotations

import asyncio
import json
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor, TimeoutError as StillWorking
from dataclasses import dataclass, field
from datetime import UTC, datetime
from threading import Event, RLock
from typing import Any, NamedTuple, TypeVar

from monitor.exceptions import MonitorError, NotFoundError, StoreError
from monitor.progress import listening
from monitor.stopping import StoppedError, stoppable
from monitor.store import held_bytes
from monitor.web.asking import Asker, ForbiddenError, check_role
from monitor.web.freshness import Stamp, differ_by_imports
from monitor.web.users import Role, User

#: Two cores are the smallest machine that this runs on; answers of more at once only wait for each other.
WORKERS = 2
#: A page waits so long before it shows that something is being computed; a trend page has to come within 0.3 s.
PATIENCE_S = 0.1
#: Answers that are held, and their bytes; the oldest is forgotten, and computed again when somebody asks. The one that
#: was answered last is held whatever its size: whoever opens its page again would wait as long.
MOST, MOST_BYTES = 200, 512_000_000
#: Where only imports came since, an answer stands for so many times as long as it took: while somebody imports one
#: campaign after the other, sums over the whole fleet take a tenth of one processor and not all of it.
REST = 10.0
#: And no longer than this.
LONGEST_REST_S = 60.0
#: A refusal stands so long, as long as nothing is written: a page that asks two questions which are refused after a
#: second each would compute one while it shows the other, for ever.
REFUSAL_STANDS_S = 60.0
#: And a fault, or a database that others hold, so long: shown, and asked anew before anybody has read it twice.
FAULT_STANDS_S = 10.0

Key = TypeVar("Key")


class Outcome(NamedTuple):
    """What there was of a question when it was looked at: an answer, a refusal, or the ticket that is waited for.

    One look: whoever asked first for the answer and then whether it is done would show a page that lacks what was
    answered between the two, and is not loaded again.
    """

    answer: Any
    refusal: str
    waiting: Ticket | None


@dataclass
class Ticket:
    """A question under way, with who asked it first."""

    number: int
    question: str
    document: Mapping[str, Any]
    user: User
    future: Future[Any]
    stop: Event
    asked_at: float = field(default_factory=time.monotonic)
    asked_on: datetime = field(default_factory=lambda: datetime.now(UTC))
    #: What had been written when it was asked.
    stamp: Stamp = ()
    #: How long it was computed; None while it is not.
    took_s: float | None = None
    #: How many bytes the answer holds, about; 0 while there is none.
    bytes: int = 0
    #: Who took it back; empty as long as nobody did.
    taken_back_by: str = ""
    #: What it said of how far it is, the latest last.
    said: list[str] = field(default_factory=list)
    #: The share of the work that is done as it told last; empty where nothing is told of it.
    shares: list[float] = field(default_factory=list)
    #: What it does just now where nobody knows how far that is; empty otherwise.
    doing: list[str] = field(default_factory=list)

    @property
    def seconds(self) -> float:
        """Return how long ago it was asked."""
        return time.monotonic() - self.asked_at

    @property
    def is_rested(self) -> bool:
        """Whether it has stood for so long that it may be computed anew: ``REST`` times as long as it took."""
        return self.took_s is None or self.seconds > self.took_s + min(REST * self.took_s, LONGEST_REST_S)

    @property
    def is_done(self) -> bool:
        """Whether there is an answer, or a refusal; what was taken back has neither until it is asked again."""
        return self.future.done() and not self.is_taken_back

    @property
    def is_taken_back(self) -> bool:
        """Whether somebody took it back before there was an answer."""
        if not self.taken_back_by or not self.future.done():
            return False
        return self.future.cancelled() or isinstance(self.future.exception(), StoppedError)

    @property
    def is_stopping(self) -> bool:
        """Whether it was taken back and still goes on to its next checkpoint."""
        return bool(self.taken_back_by) and not self.future.done()

    @property
    def is_good(self) -> bool:
        """Whether it is under way, was taken back, has an answer, or a refusal or fault that stands."""
        if not self.is_done:
            return True
        if self.future.cancelled():
            return False
        error = self.future.exception()
        # Not noted yet: it ended just now.
        if error is None or self.took_s is None:
            return True
        is_refusal = isinstance(error, MonitorError) and not isinstance(error, StoreError)
        return self.seconds < self.took_s + (REFUSAL_STANDS_S if is_refusal else FAULT_STANDS_S)

    @property
    def is_refused(self) -> bool:
        """Whether it ended without an answer, by a refusal or a fault."""
        return self.is_done and not self.future.cancelled() and self.future.exception() is not None

    def may_be_taken_back_by(self, user: User) -> bool:
        """Whether this user asked it, or is an approver."""
        return user.name == self.user.name or user.role >= Role.APPROVER

    @property
    def is_running(self) -> bool:
        """Whether it is computed now; else it waits for others."""
        return self.future.running()

    def answer(self, patience: float = PATIENCE_S) -> Any:
        """Return the answer, None where it is not there yet or was taken back. Raises what the question raised.

        The patience counts from when it was asked first, so that a page with four questions waits once.
        """
        try:
            return self.future.result(timeout=max(patience - self.seconds, 0.0))
        except (StillWorking, CancelledError, StoppedError):
            return None

    async def settled(self, patience: float) -> None:
        """Wait until there is an answer or a refusal, at most so many seconds after it was asked first.

        No thread waits with it: some forty answer all pages.
        """
        waited_for = asyncio.wrap_future(self.future)
        # Read here, or asyncio reports a refusal as one that nobody saw; the page asks for it by ``answer``.
        waited_for.add_done_callback(lambda future: future.cancelled() or future.exception())
        await asyncio.wait([waited_for], timeout=max(patience - self.seconds, 0.0))

    def outcome(self) -> Outcome:
        """Return the answer, or why there is none, or this ticket while it is computed."""
        try:
            answer = self.answer()
        except MonitorError as error:
            return Outcome(None, str(error), None)
        return Outcome(answer, "", self if answer is None else None)


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
            self._count += 1
            stop, shares, doing = Event(), list[float](), list[str]()
            pool = self._quick if question == "trend" and document.get("parameter") else self._pool
            future = pool.submit(self._answered, stop, shares, doing, user, question, document, files)
            self._tickets[key] = ticket = Ticket(
                self._count, question, document, user, future, stop, stamp=key[2], shares=shares, doing=doing
            )
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
        said: list[str] = []
        stop = Event()

        def stoppably() -> Any:
            with stoppable(stop):
                return work(said.append)

        with self._lock:
            self._count += 1
            future = self._writers.submit(stoppably)
            ticket = Ticket(self._count, question, subject, user, future, stop, said=said)
            self._written[ticket.number] = ticket
            while len(self._written) > MOST:
                self._written.popitem(last=False)
            return ticket

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

    def _answered(
        self,
        stop: Event,
        shares: list[float],
        doing: list[str],
        user: User,
        question: str,
        document: Mapping[str, Any],
        files: Mapping[str, Any] | None,
    ) -> Any:

        def tell(share: float) -> None:
            shares[:] = [share]

        def say(activity: str) -> None:
            doing[:] = [activity] if activity else []

        with stoppable(stop), listening(tell, say):
            return self.asker(user, question, document, files)

    def under_way(self) -> list[Ticket]:
        """Return what is not answered yet, in the order of asking."""
        with self._lock:
            every = [*self._tickets.values(), *self._written.values()]
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
        ticket.taken_back_by = user.name
        ticket.stop.set()
        ticket.future.cancel()
        return ticket

    def ask_again(self, number: int) -> None:
        """Forget that a question was taken back: the next page that needs it asks it anew."""
        with self._lock:
            for key, ticket in list(self._tickets.items()):
                if ticket.number == number and ticket.is_taken_back:
                    del self._tickets[key]

    def close(self) -> None:
        """Wait for what is being computed, so that nothing is left half; take back what waits."""
        for pool in (self._pool, self._quick, self._writers):
            pool.shutdown(wait=True, cancel_futures=True)


def _without(tickets: dict[Key, Ticket], forgotten: Ticket) -> dict[Key, Ticket]:
    return {key: ticket for key, ticket in tickets.items() if ticket is not forgotten}
