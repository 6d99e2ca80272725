"""Events of a machine: a crash, a repair, a compensation, a note; recorded and listed."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from monitor.exceptions import InputError, NotFoundError
from monitor.store import Database, EventRow, list_events, list_machines, record_event


@dataclass(frozen=True)
class EventRequest:
    """An event to be recorded. Raises InputError without a text, and for a time in the future."""

    machine: str
    at: datetime
    kind: str
    text: str

    def __post_init__(self) -> None:
        if not self.text.strip():
            raise InputError("say in words what happened, for example 'B axis encoder changed'")
        if self.at > datetime.now(UTC) + timedelta(hours=1):
            raise InputError(
                f"{self.at.isoformat()} lies in the future, and an event cannot be undone; give the time it had"
            )


@dataclass(frozen=True)
class EventsRequest:
    """The events of a machine; of all machines where ``machine`` is None."""

    machine: str | None = None


@dataclass(frozen=True)
class EventsAnswer:
    """Recorded events by machine and time."""

    events: tuple[EventRow, ...]


def record(db: Database, request: EventRequest) -> EventsAnswer:
    """Record what happened to a machine; its events with the new one. Raises InputError, NotFoundError."""
    record_event(db, request.machine, request.at, request.kind, request.text)
    return EventsAnswer(list_events(db, request.machine))


def events(db: Database, request: EventsRequest) -> EventsAnswer:
    """List what was recorded of a machine, or of all. Raises NotFoundError for an unknown machine."""
    machines = [str(name) for name in list_machines(db)["machine"]]
    if request.machine is not None and request.machine not in machines:
        raise NotFoundError(
            f"there is no machine {request.machine!r}; there are {', '.join(machines) or 'none yet'}"
        )
    return EventsAnswer(list_events(db, request.machine))
