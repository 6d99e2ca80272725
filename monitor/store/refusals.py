"""Imports that were refused: who reads a report later learns which data never arrived, and whether they came since.

Of a refused folder its path, its faults and the names in it are stored, nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from monitor import __version__
from monitor.store import audit
from monitor.store.connection import Database

#: Faults stored as sentences, as many as a refusal shows; the others are counted.
FAULTS_KEPT = 20


@dataclass(frozen=True)
class StoredRefusal:
    """A refused import. ``at`` is local time by the importing computer's clock; ``cleared_at`` UTC, None while open."""

    number: int
    at: datetime
    folder: str
    campaign: str | None
    machine: str | None
    fault_count: int
    faults: tuple[str, ...]
    imported_as: str | None
    cleared_at: datetime | None


def record_refusal(
    db: Database,
    folder: str,
    faults: Sequence[str],
    *,
    campaign: str | None = None,
    machine: str | None = None,
    at: datetime | None = None,
) -> int:
    """Record that a folder was refused; its number. ``at`` (with its offset) is now where it is not given.

    A folder that is refused again on the same day for the same faults (a job that tries every five minutes) is
    recorded once: the number is that of the first refusal.
    """
    moment = at or datetime.now().astimezone()
    offset = moment.utcoffset() or timedelta()
    folder, texts = _utf8(folder), [_utf8(fault) for fault in faults[:FAULTS_KEPT]]
    with db.transaction():
        day = moment.date()
        for refusal in refusals(db):
            same = (refusal.folder, refusal.fault_count, list(refusal.faults)) == (folder, len(faults), texts)
            if same and refusal.cleared_at is None and refusal.at.date() == day:
                return refusal.number
        number = db.next_number("refused_import", "refusal_id")
        db.execute(
            "INSERT INTO refused_import VALUES (?, ?, ?, ?, ?, ?, ?, ?::VARCHAR[], ?)",
            [
                number,
                moment.astimezone(UTC).replace(tzinfo=None),
                offset.total_seconds(),
                folder,
                campaign,
                machine,
                len(faults),
                texts,
                __version__,
            ],
        )
        audit.record(db, "refuse", "refused import", str(number), refusal_content(db, number))
    return number


def clear_refusals(db: Database, folder: str, campaign: str, at: datetime | None = None) -> tuple[int, ...]:
    """Mark the open refusals of a folder, or of a campaign of that name, as settled: it was imported well."""
    moment = (at or datetime.now(UTC)).astimezone(UTC).replace(tzinfo=None)
    with db.transaction():
        open_ones = db.rows(
            "SELECT refusal_id FROM v_refused_imports WHERE cleared_at IS NULL AND (folder = ? OR campaign = ?) "
            "ORDER BY refusal_id",
            [_utf8(folder), campaign],
        )
        for (number,) in open_ones:
            db.execute("INSERT INTO refusal_cleared VALUES (?, ?, ?)", [number, campaign, moment])
            audit.record(db, "clear", "cleared refusal", str(number), cleared_content(db, number))
    return tuple(int(number) for (number,) in open_ones)


def refusals(
    db: Database, begins: datetime = datetime.min, ends: datetime = datetime.max
) -> tuple[StoredRefusal, ...]:
    """What was refused from ``begins`` until before ``ends`` (local times), in the order of recording."""
    rows = db.rows(
        "SELECT refusal_id, refused_at_local, folder, campaign, machine, fault_count, faults, imported_as, cleared_at "
        "FROM v_refused_imports WHERE refused_at_local >= ? AND refused_at_local < ?",
        [begins, ends],
    )
    return tuple(
        StoredRefusal(number, at, folder, campaign, machine, count, tuple(faults), imported_as, cleared)
        for number, at, folder, campaign, machine, count, faults, imported_as, cleared in rows
    )


def _utf8(text: str) -> str:
    """A path may hold bytes that are no UTF-8; a database text may not."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def refusal_content(db: Database, number: int) -> str:
    """The hash of all that is stored of a refusal."""
    return audit.digest(*db.rows("SELECT * FROM refused_import WHERE refusal_id = ?", [number]))


def cleared_content(db: Database, number: int) -> str:
    """The hash of what is stored of its settlement."""
    return audit.digest(*db.rows("SELECT * FROM refusal_cleared WHERE refusal_id = ?", [number]))
