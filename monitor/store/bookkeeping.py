"""Columns that say how and when something was stored: their hash goes into the audit together with that of the content.

The content of a campaign, an identification or a model is hashed as what it means, so that the hash can be computed
again by any later version. Beside it stand numbers, versions, moments and fingerprints. An entry of the audit holds the
hash of both; entries of before this was so hold the hash of the content alone, and are compared with that.

A campaign also holds the books that no entry of their own keeps: which migrations were applied before it, when and by
which version, and when its machine was first registered.
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterator, Sequence
from typing import Any

from monitor.store.connection import Database

#: Rows that belong to a subject of the audit, by its number (of a model: its key). Columns that later versions add are
#: not among those named, so that an old entry still fits.
_ROWS = {
    "campaign": (
        "SELECT campaign_id, campaign, machine, content_sha256, software_version, imported_at FROM imported_campaign "
        "WHERE campaign_id = ?",
        "SELECT run, readings_sha256 FROM run_fingerprint WHERE campaign_id = ? ORDER BY ALL",
    ),
    "identification": (
        "SELECT identification_id, campaign_id, run_count, software_version, computed_at FROM identification "
        "WHERE identification_id = ?",
    ),
    "model": (
        "SELECT model, version, parent, parent_version, software_version, created_at FROM model "
        "WHERE concat(model, ' version ', version) = ?",
    ),
}


#: Rows that entries hold since version 0.3.0, besides.
_ROWS_OF_BEFORE = {
    "campaign": (
        "SELECT number, name, sha256, schema_migration.software_version, applied_at FROM schema_migration "
        "JOIN imported_campaign ON applied_at <= imported_at WHERE campaign_id = ? ORDER BY number",
        "SELECT registration, machine, topology, registered_at FROM registered_machine "
        "JOIN imported_campaign USING (machine) WHERE registered_at <= imported_at AND campaign_id = ? ORDER BY ALL",
    ),
}


def with_bookkeeping(db: Database, subject: str, number: int | str, content_sha256: str) -> str:
    """Return the hash of a content and of the rows that keep its books; that of the content where it has none."""
    return _hash(db, (*_ROWS.get(subject, ()), *_ROWS_OF_BEFORE.get(subject, ())), number, content_sha256)


def earlier_hashes(db: Database, subject: str, number: int | str, content_sha256: str) -> tuple[str, ...]:
    """Return the hashes that an entry of an earlier version holds: with the books of its subject alone, and without."""
    return _hash(db, _ROWS.get(subject, ()), number, content_sha256), content_sha256


def hashes_of_fewer_books(
    db: Database, subject: str, number: int | str, content_sha256: str
) -> Iterator[str]:
    """Yield the hashes with the first so many of the rows of before, by their numbers.

    What was there before is told by times, and a clock that was ahead makes what came later look earlier: a migration
    applied once it was right again. Each row that is counted still has to be as it was.
    """
    of_before = [db.rows(query, [number]) for query in _ROWS_OF_BEFORE.get(subject, ())]
    if not of_before or not content_sha256:
        return
    of_its_own = [row for query in _ROWS.get(subject, ()) for row in db.rows(query, [number])]
    for counts in itertools.product(*(range(len(rows) + 1) for rows in of_before)):
        first = [row for rows, count in zip(of_before, counts, strict=True) for row in rows[:count]]
        yield _hash_of_rows(content_sha256, [*of_its_own, *first])


def _hash(db: Database, queries: Sequence[str], number: int | str, content_sha256: str) -> str:
    if not queries or not content_sha256:
        return content_sha256
    return _hash_of_rows(content_sha256, [row for query in queries for row in db.rows(query, [number])])


def _hash_of_rows(content_sha256: str, rows: Sequence[tuple[Any, ...]]) -> str:
    digest = hashlib.sha256(content_sha256.encode())
    for row in rows:
        digest.update(repr(row).encode())
    return digest.hexdigest()
