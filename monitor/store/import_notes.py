"""What was noticed at an import, in sentences stored with the campaign, and the hash of the readings of each run.

Readings of a run that equal those of another in every digit are a copy, never chance; counted as independent they
would make every uncertainty too small. The hash of a run's readings tells them without reading the readings again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np

from monitor.records import Array, Probings
from monitor.store import audit, probings
from monitor.store.connection import Database
from monitor.store.record_json import as_imported, machine_record
from monitor.units import CONDITION_SUFFIXES

#: Fewer probings than these may agree by chance: a controller that prints whole micrometres and a machine that
#: repeats to 0.3 µm print the same coordinate again with a probability near 0.9; twelve times it happens in 0.3.
#: With two or three coordinates a probing, or a finer print, it does not.
FEWEST_PROBINGS = 12

#: Names of targets that become text at a time: those of a million rows take 60 MB.
ROWS_AT_ONCE = 50_000


def run_fingerprints(touches: Probings, *, signed_zeros: bool = False) -> dict[int, str]:
    """The hash of targets and readings by run, of every run with ``FEWEST_PROBINGS`` or more.

    Times and recorded conditions (temperatures) are left out: who copies a run may give it others. So is the sign of a
    zero, which a workbook does not keep; with ``signed_zeros`` it counts, as it did until November 2026.
    """
    measured = _measured(touches)
    order = np.argsort(touches.run, kind="stable")
    runs, starts = np.unique(touches.run[order], return_index=True)
    prints = {}
    for run, rows in zip(runs.tolist(), np.split(order, starts[1:]), strict=True):
        if len(rows) < FEWEST_PROBINGS:
            continue
        fingerprint = hashlib.sha256()
        for start in range(0, len(rows), ROWS_AT_ONCE):
            targets = touches.target[rows[start : start + ROWS_AT_ONCE]].tolist()
            fingerprint.update(("\0" * bool(start) + "\0".join(targets)).encode())
        for name in sorted(measured):
            fingerprint.update(
                name.encode() + b"\0" + audit.bits(measured[name][rows], signed_zeros=signed_zeros)
            )
        prints[int(run)] = fingerprint.hexdigest()
    return prints


def _measured(touches: Probings) -> dict[str, Array]:
    """Readings, and channels that are no recorded conditions, by name."""
    return {**touches.readings} | {
        name: values
        for name, values in touches.channels.items()
        if name.rpartition("_")[2] not in CONDITION_SUFFIXES
    }


def keep_fingerprints(db: Database, campaign_id: int, touches: Probings) -> None:
    """Add the hashes of a campaign's runs, and those of campaigns that came in before there were any."""
    _insert(db, campaign_id, run_fingerprints(touches) | _known_with_signs(db, touches))
    older = db.rows(
        "SELECT campaign_id FROM campaign WHERE method <> 'curve' AND campaign_id <> ? "
        "AND campaign_id NOT IN (SELECT campaign_id FROM run_fingerprint) ORDER BY campaign_id",
        [campaign_id],
    )
    for (number,) in older:
        _insert(db, number, stored_fingerprints(db, number))


def stored_fingerprints(db: Database, campaign_id: int) -> dict[int, str]:
    """The hashes by run of the stored readings of a campaign that counts, computed anew."""
    ((name, machine),) = db.rows(
        "SELECT campaign, machine_description FROM campaign WHERE campaign_id = ?", [campaign_id]
    )
    with as_imported(name):
        described = machine_record(machine)
    return run_fingerprints(probings.as_record(probings.select(db, campaign_id), described))


def _known_with_signs(db: Database, touches: Probings) -> dict[int, str]:
    """The hashes with the signs of zeros, by run, of those that the database holds so from before November 2026: stored
    hashes are in the audit and stay, and the same file is a copy of them all the same."""
    if not any(np.any((values == 0.0) & np.signbit(values)) for values in _measured(touches).values()):
        return {}
    prints = run_fingerprints(touches, signed_zeros=True)
    stored = db.rows(
        "SELECT DISTINCT readings_sha256 FROM run_fingerprint WHERE readings_sha256 IN (SELECT unnest(?::VARCHAR[]))",
        [list(prints.values())],
    )
    return {run: fingerprint for run, fingerprint in prints.items() if (fingerprint,) in stored}


def _insert(db: Database, campaign_id: int, prints: dict[int, str]) -> None:
    # A campaign whose runs are all short leaves a row, too, so that it is not looked at again with every import.
    rows = prints or {0: ""}
    db.execute(
        "INSERT INTO run_fingerprint SELECT ?, unnest(?::BIGINT[]), unnest(?::VARCHAR[])",
        [campaign_id, list(rows), list(rows.values())],
    )


def keep_notes(db: Database, campaign_id: int, notes: Sequence[str]) -> None:
    """Add what was noticed, with its entry in the audit; nothing where there is nothing."""
    if not notes:
        return
    for position, note in enumerate(notes, start=1):
        db.execute("INSERT INTO import_note VALUES (?, ?, ?)", [campaign_id, position, note])
    audit.record(db, "note", "import notes", str(campaign_id), notes_content(db, campaign_id))


def notes_content(db: Database, campaign_id: int) -> str:
    """The hash of the notes of a campaign."""
    return audit.digest(
        *db.rows("SELECT * FROM import_note WHERE campaign_id = ? ORDER BY position", [campaign_id])
    )
