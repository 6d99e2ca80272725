"""What people know of a machine: record an event, or list what was recorded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta

from monitor.exceptions import InputError, did_you_mean
from monitor.reporting import messages, record_messages
from monitor.said import check_letters
from monitor.store import (
    NOTE,
    Database,
    StoredEvent,
    list_campaigns,
    list_events,
    record_event,
    withdraw_event,
)
from monitor.store.catalogue import check_machine
from monitor.workflow.moments import at_machine

#: Before it nobody recorded what happened to a machine that is measured today.
FIRST_YEAR = 1900
LONGEST_TEXT = 2000
#: An event so long before the first run of its machine is asked about: most are of a mistyped year.
LONG_BEFORE = timedelta(days=366)
#: The kinds that most events are of; any other word is one, too.
USUAL_KINDS = ("crash", "repair", "compensation", "probe")


@dataclass(frozen=True)
class EventRequest:
    """Record ``text`` as an event of a ``kind`` that happened ``at`` a moment (without an offset from UTC by the clock
    of the shop); without text list them.

    An event of any kind but a note splits the history of the machine. ``before_runs`` confirms that it happened more
    than a year before the first run. Raises InputError for a kind that is nearly a usual one, a moment to come, a
    moment or kind without words, or characters that nobody sees.
    """

    machine: str
    text: str | None = None
    at: datetime | None = None
    kind: str = NOTE
    before_runs: bool = False

    def __post_init__(self) -> None:
        if self.text is None:
            self._refuse_unsaid()
            return
        if not self.text.strip():
            raise InputError("say in words what happened, for example 'B axis encoder changed'")
        for line in self.text.splitlines():
            check_letters(line.replace("\t", " "), "what happened")
        check_letters(self.kind, "the kind")
        word = self.text.strip().lower()
        if self.kind == NOTE and word in USUAL_KINDS:
            raise InputError(
                f"'{word}' is a kind of event; a note would not split the history: give "
                f"--kind {word} and say in words what happened, for example 'spindle hit the vice'"
            )
        if len(self.text) > LONGEST_TEXT:
            raise InputError(
                f"what happened is said in {LONGEST_TEXT} letters at most, not {len(self.text)}: it stands in tables, "
                "on charts and in reports"
            )
        if self.at is not None and self.at.year < FIRST_YEAR:
            raise InputError(f"{self.at.isoformat()} lies before {FIRST_YEAR}; give the time it had")
        if (
            self.at is not None
            and self.at.tzinfo is not None
            and self.at > datetime.now(UTC) + timedelta(hours=1)
        ):
            raise InputError(f"{self.at.isoformat()} lies in the future; give the time it had")
        hint = did_you_mean(self.kind, (*USUAL_KINDS, NOTE))
        if hint and self.kind not in (*USUAL_KINDS, NOTE):
            raise InputError(
                f"--kind {self.kind}: {hint}a kind that is nearly a usual one "
                f"({', '.join((*USUAL_KINDS, NOTE))}) is not recorded; any other word is"
            )

    def _refuse_unsaid(self) -> None:
        """Raise InputError for a moment or kind without words, which is no question for the list."""
        if self.at is not None or self.kind != NOTE:
            raise InputError(
                "say in words what happened, for example 'B axis encoder changed': nothing was recorded; the list of "
                "events takes neither a time nor a kind"
            )


@dataclass(frozen=True)
class EventAnswer:
    """The events of the machine, in the order of time; ``notes`` say what the one recorded now does not do."""

    events: tuple[StoredEvent, ...]
    notes: tuple[str, ...] = ()


def event(db: Database, request: EventRequest) -> EventAnswer:
    """Record what happened to a machine, or list what was recorded. Raises NotFoundError, InputError."""
    check_machine(db, request.machine)
    if request.text is not None:
        if request.at is None:
            raise InputError(
                "say when it happened: --at 2026-03-05T07:00:00-05:00, or --at '2026-03-05 07:00' "
                "in the time of this computer"
            )
        at, text = at_machine(db, request.machine, request.at), request.text
        request = replace(request, at=at)
        _refuse_long_before(db, request, at)
        record_event(db, request.machine, at, request.kind, text)
    return EventAnswer(list_events(db, request.machine), tuple(_notes(db, request)))


@dataclass(frozen=True)
class EventsRequest:
    """The events of a machine."""

    machine: str


def events(db: Database, request: EventsRequest) -> EventAnswer:
    """List what was recorded of a machine and counts. Raises NotFoundError."""
    check_machine(db, request.machine)
    return EventAnswer(list_events(db, request.machine))


@dataclass(frozen=True)
class WithdrawEventRequest:
    """An event of a machine, by its ``number``, that is to count no longer, and why."""

    machine: str
    number: int
    reason: str


def withdraw(db: Database, request: WithdrawEventRequest) -> EventAnswer:
    """Let an event count no longer; it stays in the tables and the audit. Raises InputError, NotFoundError."""
    withdraw_event(db, request.machine, request.number, request.reason)
    return EventAnswer(list_events(db, request.machine))


def _first_run(db: Database, machine: str) -> datetime | None:
    """When the first run of a machine began, in UTC without a zone."""
    begins = [row.first_run_at for row in list_campaigns(db, machine=machine)]
    return min((moment for moment in begins if moment is not None), default=None)


def _refuse_long_before(db: Database, request: EventRequest, at: datetime) -> None:
    """Raise InputError for an event more than a year before the first run that nobody confirmed."""
    first = _first_run(db, request.machine)
    if first is None or request.before_runs or at.astimezone(UTC).replace(tzinfo=None) >= first - LONG_BEFORE:
        return
    raise InputError(record_messages.long_before_all_runs(request.machine, at, first))


def _notes(db: Database, request: EventRequest) -> Iterator[str]:
    """Yield that an event lies before every run of its machine, as one of a mistyped year does."""
    if request.text is None or request.at is None:
        return
    first = _first_run(db, request.machine)
    if first is not None and request.at.astimezone(UTC).replace(tzinfo=None) < first:
        yield messages.before_all_runs(request.machine, first)
