"""Long questions in threads of their own: a page waits a moment for the answer, else shows that it is being computed.

A question is the same for everybody who asks it, and its answer holds until something is written: a page that is loaded
again finds the work where it is.
"""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as StillWorking
from dataclasses import dataclass, field
from threading import Lock
from typing import Any

from monitor.web.asking import Asker, check_role
from monitor.web.freshness import Stamp
from monitor.web.users import User

#: Two cores are the smallest machine that this runs on; answers of more at once only wait for each other.
WORKERS = 2
#: A page waits so long before it shows that something is being computed; a trend page has to come within 0.3 s.
PATIENCE_S = 0.1
#: Answers that are held; the oldest is forgotten, and computed again when somebody asks.
MOST = 200


@dataclass
class Ticket:
    """A question under way, with who asked it first."""

    number: int
    question: str
    document: Mapping[str, Any]
    user: User
    future: Future[Any]
    asked_at: float = field(default_factory=time.monotonic)

    @property
    def seconds(self) -> float:
        """Return how long ago it was asked."""
        return time.monotonic() - self.asked_at

    @property
    def is_done(self) -> bool:
        """Whether there is an answer, or a refusal."""
        return self.future.done()

    @property
    def is_good(self) -> bool:
        """Whether it is under way, or has an answer: what was cancelled or refused is asked anew."""
        return not self.is_done or not (self.future.cancelled() or self.future.exception())

    @property
    def is_running(self) -> bool:
        """Whether it is computed now; else it waits for others."""
        return self.future.running()

    def answer(self, patience: float = PATIENCE_S) -> Any:
        """Return the answer, None where it is not there yet or was cancelled. Raises what the question raised.

        The patience counts from when it was asked first, so that a page with four questions waits once.
        """
        try:
            return self.future.result(timeout=max(patience - self.seconds, 0.0))
        except (StillWorking, CancelledError):
            return None


class Desk:
    """Takes questions, computes two at a time, and holds what was answered."""

    def __init__(self, asker: Asker) -> None:
        self.asker = asker
        self._pool = ThreadPoolExecutor(WORKERS, thread_name_prefix="monitor-desk")
        self._tickets: dict[tuple[str, str, Stamp], Ticket] = {}
        self._lock = Lock()
        self._count = 0

    def ask(
        self, user: User, question: str, document: Mapping[str, Any], files: Mapping[str, Any] | None = None
    ) -> Ticket:
        """Return the ticket of a question, a new one where nobody asked it since the last change.

        ``files`` are paths that the server itself fills in; they are no part of what is asked.
        """
        check_role(user, question)
        key = (
            question,
            json.dumps(document, sort_keys=True, default=str),
            self.asker.freshness.stamp(question, document),
        )
        with self._lock:
            ticket = self._tickets.get(key)
            if ticket is not None and ticket.is_good:
                return ticket
            self._count += 1
            future = self._pool.submit(self.asker, user, question, document, files)
            self._tickets[key] = ticket = Ticket(self._count, question, document, user, future)
            while len(self._tickets) > MOST:
                del self._tickets[next(iter(self._tickets))]
            return ticket

    def under_way(self) -> list[Ticket]:
        """Return what is not answered yet, in the order of asking."""
        with self._lock:
            return [ticket for ticket in self._tickets.values() if not ticket.is_done]

    def cancel(self, number: int) -> bool:
        """Take back a question that still waits; one that is being computed ends by itself."""
        return any(ticket.future.cancel() for ticket in self.under_way() if ticket.number == number)

    def close(self) -> None:
        """Wait for what is being computed, so that nothing is left half; take back what waits."""
        self._pool.shutdown(wait=True, cancel_futures=True)
