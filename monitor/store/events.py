"""Events that people know of a machine: a crash, a repair, a compensation applied, another probe."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import UTC, datetime

from monitor.documents import IN_UTC
from monitor.exceptions import InputError
from monitor.store import audit
from monitor.store.catalogue import check_machine
from monitor.store.connection import Database, utc_now

#: A note is shown beside the history. An event of any other kind may have changed the machine, and splits it.
NOTE = "note"


@dataclass(frozen=True)
class EventRow:
    """An event as the view ``v_events`` has it; ``happened_at_local`` is by the shop's clock."""

    event_id: int
    machine: str
    happened_at: datetime = field(metadata=IN_UTC)
    happened_at_local: datetime
    kind: str
    description: str
    recorded_at: datetime = field(metadata=IN_UTC)


def record_event(db: Database, machine: str, happened_at: datetime, kind: str, description: str) -> int:
    """Keep an event of a machine; its number. ``happened_at`` has an offset from UTC.

    Raises InputError for a time without an offset or an empty kind, NotFoundError for an unknown machine.
    """
    offset = happened_at.utcoffset()
    if offset is None:
        raise InputError(
            f"the time of an event needs its offset from UTC; {happened_at.isoformat()} has none"
        )
    if not kind.strip():
        raise InputError("an event needs a kind, for example 'repair'")
    with db.transaction():
        check_machine(db, machine)
        number = db.next_number("event", "event_id")
        db.execute(
            "INSERT INTO event VALUES (?, ?, ?, ?, ?, ?, ?)",
            [
                number,
                machine,
                happened_at.astimezone(UTC).replace(tzinfo=None),
                offset.total_seconds(),
                kind,
                description,
                utc_now(),
            ],
        )
        audit.record(db, "record", "event", str(number), event_content(db, number))
    return number


def list_events(db: Database, machine: str | None = None) -> tuple[EventRow, ...]:
    """Return the events of all machines or of one, by machine and time."""
    return db.records(
        EventRow,
        "SELECT * FROM v_events WHERE $machine IS NULL OR machine = $machine ORDER BY machine, happened_at",
        {"machine": machine},
    )


def machine_events(db: Database, machine: str) -> list[tuple[datetime, str, str]]:
    """Time (UTC), kind and description of the events of a machine, in the order of time."""
    rows = db.rows(
        "SELECT happened_at, kind, description FROM v_events WHERE machine = ? ORDER BY happened_at",
        [machine],
    )
    return [(at.replace(tzinfo=UTC), kind, text) for at, kind, text in rows]


def event_content(db: Database, number: int) -> str:
    """The hash of all that is stored of an event."""
    return audit.digest(*db.rows("SELECT * FROM event WHERE event_id = ?", [number]))
