"""Events that people know of a machine: a crash, a repair, a compensation applied, another probe."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta, timezone

from monitor.documents import IN_UTC
from monitor.exceptions import InputError
from monitor.store import audit
from monitor.store.catalogue import check_machine
from monitor.store.connection import Database, utc_now

#: A note is shown beside the history. An event of any other kind may have changed the machine, and splits it.
NOTE = "note"


@dataclass(frozen=True)
class StoredEvent:
    """A row of the view ``v_events``; times in UTC without a zone, ``happened_at_local`` by the shop's clock."""

    event_id: int
    machine: str
    happened_at: datetime = field(metadata=IN_UTC)
    happened_at_local: datetime
    kind: str
    description: str
    recorded_at: datetime = field(metadata=IN_UTC)


@dataclass(frozen=True)
class MachineEvent:
    """What people know of a machine; ``at`` in the shop's offset from UTC."""

    at: datetime
    kind: str
    description: str


def record_event(db: Database, machine: str, happened_at: datetime, kind: str, description: str) -> int:
    """Record an event of a machine; return its number. ``happened_at`` has an offset from UTC.

    Raises InputError for a time without an offset, an empty kind or an event that is recorded already, NotFoundError
    for an unknown machine.
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
        _refuse_twice(db, machine, happened_at, kind, description)
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


def _refuse_twice(db: Database, machine: str, happened_at: datetime, kind: str, description: str) -> None:
    """Raise InputError where the same was recorded of the same moment."""
    moment = happened_at.astimezone(UTC).replace(tzinfo=None)
    same = db.rows(
        "SELECT event_id FROM v_events WHERE machine = ? AND happened_at = ? AND kind = ? "
        "AND lower(trim(description)) = lower(trim(?))",
        [machine, moment, kind, description],
    )
    if same:
        raise InputError(
            f"this {kind} of {machine} is recorded already, as event {same[0][0]} of {moment:%Y-%m-%d %H:%M} UTC; "
            "nothing was stored"
        )


def list_events(db: Database, machine: str | None = None) -> tuple[StoredEvent, ...]:
    """The events of all machines or of one, by machine and time: the view ``v_events``."""
    rows = db.rows(
        "SELECT event_id, machine, happened_at, happened_at_local, kind, description, recorded_at FROM v_events "
        "WHERE $machine IS NULL OR machine = $machine ORDER BY machine, happened_at",
        {"machine": machine},
    )
    return tuple(StoredEvent(*row) for row in rows)


def machine_events(db: Database, machine: str) -> list[MachineEvent]:
    """The events of a machine, in the order of time."""
    rows = db.rows(
        "SELECT happened_at, utc_offset_s, kind, description FROM event ANTI JOIN withdrawn_event USING (event_id) "
        "WHERE machine = ? ORDER BY happened_at",
        [machine],
    )
    return [
        MachineEvent(at.replace(tzinfo=UTC).astimezone(timezone(timedelta(seconds=offset))), kind, text)
        for at, offset, kind, text in rows
    ]


def event_content(db: Database, number: int) -> str:
    """The hash of all that is stored of an event."""
    return audit.digest(*db.rows("SELECT * FROM event WHERE event_id = ?", [number]))
