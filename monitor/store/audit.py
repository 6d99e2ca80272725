"""The audit chain: every change adds an entry that holds the hash of what was stored and of the entry before.

An entry that is altered, or left out between two others, no longer fits its neighbours. Entries cut off at
the end are detected where what they record is still there (``verification``).
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor import __version__
from monitor.documents import IN_UTC
from monitor.records import AuditAnchor
from monitor.store.connection import Database, utc_now

#: What stands in the first entry for the hash of the entry before.
NO_ENTRY_BEFORE = "0" * 64
#: How far from its place an entry is looked for that was put elsewhere.
_NEAR = 500

_COLUMNS = (
    "entry, made_at, actor, action, subject, key, content_sha256, software_version, "
    "previous_sha256, entry_sha256"
)


@dataclass(frozen=True)
class AuditEntry:
    """Who changed what and when: an entry of the audit without its hashes."""

    entry: int
    made_at: datetime = field(metadata=IN_UTC)
    actor: str
    action: str
    subject: str
    key: str
    software_version: str


def digest(*values: Any) -> str:
    """Return the SHA-256 of plain values (None, numbers, text, bytes, datetimes, lists, mappings), hexadecimal."""
    text = json.dumps(values, ensure_ascii=False, sort_keys=True, separators=(",", ":"), default=_plain)
    return hashlib.sha256(text.encode()).hexdigest()


def record(db: Database, action: str, subject: str, key: str, content_sha256: str) -> None:
    """Add an entry, inside the transaction of the change that it records."""
    last = last_anchor(db)
    values = [
        last.entry + 1,
        utc_now(),
        db.actor,
        action,
        subject,
        key,
        content_sha256,
        __version__,
        last.sha256,
    ]
    db.execute(
        f"INSERT INTO audit ({_COLUMNS}) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", [*values, digest(*values)]
    )


def last_anchor(db: Database) -> AuditAnchor:
    """Return number and hash of the last entry; entry 0 and zeros where there is none."""
    last = db.rows("SELECT entry, entry_sha256 FROM audit ORDER BY entry DESC LIMIT 1")
    return AuditAnchor(*last[0]) if last else AuditAnchor(0, NO_ENTRY_BEFORE)


def last_entries(db: Database, count: int, containing: Sequence[str] = ()) -> tuple[AuditEntry, ...]:
    """Return the last ``count`` entries that hold every word of ``containing``, the newest first.

    A word is looked for in time (as the pages write it, UTC), actor, action, subject and key, whatever its case.
    """
    columns = "concat_ws(' ', strftime(made_at, '%Y-%m-%d %H:%M:%S'), actor, action, subject, key)"
    condition = " AND ".join([f"contains(lower({columns}), lower(?))"] * len(containing))
    return db.records(
        AuditEntry,
        "SELECT entry, made_at, actor, action, subject, key, software_version FROM audit "
        f"{'WHERE ' if containing else ''}{condition} ORDER BY entry DESC LIMIT ?",
        [*containing, count],
    )


def chain_faults(db: Database) -> tuple[str, ...]:
    """Return what is wrong with the chain: which entry was edited, removed or put elsewhere; empty where nothing is."""
    rows = db.rows(f"SELECT {_COLUMNS} FROM audit ORDER BY entry")
    entry_of = {entry_sha256: values[0] for *values, entry_sha256 in rows}
    faults = []
    previous, before = NO_ENTRY_BEFORE, 0
    for *values, entry_sha256 in rows:
        entry, follows = values[0], values[-1]
        if entry != before + 1:
            missing = f"{before + 1}" if entry == before + 2 else f"{before + 1} to {entry - 1}"
            faults.append(f"audit entry {missing} is missing: it was removed, or given another number")
        if digest(*values) != entry_sha256:
            number = _number_before(values, entry_sha256)
            how = (
                "it was edited" if number is None else f"it was written as entry {number}, and put elsewhere"
            )
            faults.append(f"audit entry {entry} was altered: {how}")
        elif follows != previous and entry == before + 1:
            position = f"entry {entry_of[follows]}" if follows in entry_of else "one that is gone"
            faults.append(
                f"audit entry {entry} does not follow the one before it: it was written behind {position}"
            )
        previous, before = entry_sha256, entry
    return tuple(faults)


def _number_before(values: list[Any], entry_sha256: str) -> int | None:
    """The number with which an entry fits its hash, among the next ones; None where it has none."""
    near = range(max(1, values[0] - _NEAR), values[0] + _NEAR)
    return next((number for number in near if digest(number, *values[1:]) == entry_sha256), None)


def anchored_entry(db: Database, anchor: str) -> AuditEntry | None:
    """Return the entry that a hash kept elsewhere is of; None where no entry has it."""
    entries = db.records(
        AuditEntry,
        "SELECT entry, made_at, actor, action, subject, key, software_version FROM audit WHERE entry_sha256 = ?",
        [anchor.strip().lower()],
    )
    return entries[0] if entries else None


def bits(values: npt.ArrayLike, *, signed_zeros: bool = False) -> bytes:
    """Return numbers as the bytes that are hashed, with one kind of NaN and one zero.

    DuckDB's compression takes the sign off a zero, or gives one (1.5.5: a run of equal values has that of its first).
    ``signed_zeros`` leaves them as they are: versions before 0.2.0 hashed them so.
    """
    numbers = np.asarray(values, dtype="<f8")
    numbers = np.where(np.isnan(numbers), np.nan, numbers)
    return (numbers if signed_zeros else numbers + 0.0).tobytes()


def _plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return hashlib.sha256(value).hexdigest()
    if isinstance(value, datetime):
        return value.isoformat()
    raise TypeError(f"{type(value).__name__} cannot be hashed")
