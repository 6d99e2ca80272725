"""Columns that say how and when something was stored: their hash goes into the audit together with that of the content.

The content of a campaign, an identification or a model is hashed as what it means, so that the hash can be computed
again by any later version. Beside it stand numbers, versions, moments and fingerprints. An entry of the audit holds the
hash of both; entries of before this was so hold the hash of the content alone, and are compared with that.
"""

from __future__ import annotations

import hashlib

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


def with_bookkeeping(db: Database, subject: str, number: int | str, content_sha256: str) -> str:
    """Return the hash of a content and of the rows that keep its books; that of the content where it has none."""
    if subject not in _ROWS or not content_sha256:
        return content_sha256
    digest = hashlib.sha256(content_sha256.encode())
    for query in _ROWS[subject]:
        for row in db.rows(query, [number]):
            digest.update(repr(row).encode())
    return digest.hexdigest()
