"""A ticket of the desk: a question under way, who asked it, how far it is, and what came of it."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import CancelledError, Future, TimeoutError as StillWorking
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any, NamedTuple

from monitor.exceptions import MonitorError, StoreError
from monitor.progress import listening
from monitor.stopping import Stop, StoppedError, stoppable
from monitor.web.freshness import Stamp
from monitor.web.users import Role, User

#: A page waits so long before it shows that something is being computed; a trend page has to come within 0.3 s.
PATIENCE_S = 0.1
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
    #: What had been written when it was asked.
    stamp: Stamp = ()
    #: Whether a program waits for it, by HTTP, in a thread of its own.
    is_of_program: bool = False
    future: Future[Any] = field(default_factory=Future)
    stop: Stop = field(default_factory=Stop)
    asked_at: float = field(default_factory=time.monotonic)
    asked_on: datetime = field(default_factory=lambda: datetime.now(UTC))
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

    @contextmanager
    def followed(self) -> Iterator[None]:
        """Let what this thread does in the block say how far it is, and end where it is taken back."""
        with stoppable(self.stop), listening(self._tell, self._say):
            yield

    def _tell(self, share: float) -> None:
        self.shares[:] = [share]

    def _say(self, activity: str) -> None:
        self.doing[:] = [activity] if activity else []

    def take_back(self, by: str) -> None:
        """End it: while it waits at once, while it is computed at its next checkpoint."""
        self.taken_back_by = by
        self.stop.set()
        self.future.cancel()

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

    @property
    def has_page(self) -> bool:
        """Whether a page of its own says how far it is, and where it stopped: that of an import by a form."""
        return self.question == "import" and not self.is_of_program

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
