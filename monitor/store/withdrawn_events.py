"""Events that should not have been recorded, as of a mistyped year: withdrawn with a reason, and told so in the audit.

Nothing is deleted: the view ``v_events``, and all that read events, leave the withdrawn out.
"""

from __future__ import annotations

from monitor import __version__
from monitor.exceptions import NotFoundError
from monitor.said import reason as said_reason
from monitor.store import audit
from monitor.store.catalogue import check_machine
from monitor.store.connection import Database, utc_now


def withdraw_event(db: Database, machine: str, number: int, reason: str) -> None:
    """Let the event of a number count no longer.

    Raises InputError without a reason, NotFoundError where the machine has no such event (any more).
    """
    reason = said_reason(
        reason, f'say in words why event {number} is withdrawn, for example "the year was mistyped"'
    )
    with db.transaction():
        check_machine(db, machine)
        rows = db.rows("SELECT 1 FROM v_events WHERE event_id = ? AND machine = ?", [number, machine])
        if not rows:
            numbers = [str(of) for (of,) in db.rows(
                "SELECT event_id FROM v_events WHERE machine = ? ORDER BY event_id DESC LIMIT 20", [machine]
            )]  # fmt: skip
            raise NotFoundError(
                f"machine {machine} has no event {number} that counts; "
                + (f"it has {', '.join(numbers)}" if numbers else "it has none")
            )
        db.execute(
            "INSERT INTO withdrawn_event VALUES (?, ?, ?, ?)", [number, reason, __version__, utc_now()]
        )
        audit.record(db, "withdraw", "withdrawn event", str(number), withdrawn_event_content(db, number))


def withdrawn_event_content(db: Database, number: int) -> str:
    """The hash of all that is stored of a withdrawal."""
    return audit.digest(*db.rows("SELECT * FROM withdrawn_event WHERE event_id = ?", [number]))
