"""What was noticed at an import: sentences stored with the campaign, and runs that were imported before.

Readings of a run that equal those of another in every digit are a copy, never chance; counted as independent they
would make every uncertainty too small. The hash of a run's readings tells them without reading the readings again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from itertools import groupby
from typing import Any

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
#: A folder imported again and again under new names: so many campaigns, and runs of each, are named.
MOST_CAMPAIGNS, MOST_PAIRS = 5, 5


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
        "SELECT campaign_id, campaign, machine_description FROM campaign WHERE method <> 'curve' AND campaign_id <> ? "
        "AND campaign_id NOT IN (SELECT campaign_id FROM run_fingerprint) ORDER BY campaign_id",
        [campaign_id],
    )
    for number, name, machine in older:
        with as_imported(name):
            described = machine_record(machine)
        record = probings.as_record(probings.select(db, number), described)
        _insert(db, number, run_fingerprints(record))


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


def campaign_notes(db: Database, campaign: str) -> tuple[str, ...]:
    """Return the notes of a campaign's import, and sentences on runs that equal others' in every digit."""
    notes = [
        str(note)
        for (note,) in db.rows(
            "SELECT note FROM v_import_notes WHERE campaign = ? ORDER BY position", [campaign]
        )
    ]
    repeated = db.rows(
        "SELECT same_as_campaign, same_as_machine, machine, run, same_as_run FROM v_repeated_runs "
        "WHERE campaign = ? ORDER BY same_as_campaign, run, same_as_run",
        [campaign],
    )
    copies = [(key, list(rows)) for key, rows in groupby(repeated, key=lambda row: row[:3])]
    return (*notes, _copied(campaign, copies)) if copies else tuple(notes)


def _copied(campaign: str, copies: Sequence[tuple[tuple[Any, ...], list[tuple[Any, ...]]]]) -> str:
    """One sentence on all campaigns that hold runs of this one, however often it was imported."""
    count = len({run for _, rows in copies for *_, run, _ in rows})
    head = f"{count} run{'s' * (count > 1)} of {campaign} equal{'s' * (count == 1)}"
    never = "in every reading, which two measurements never do"
    named = [_named(key, rows) for key, rows in copies[:MOST_CAMPAIGNS]]
    if len(copies) == 1:
        ((other, pairs),) = named
        return f"{head} those of campaign {other} {never}: run {pairs}; withdraw the copy (monitor withdraw)"
    more = len(copies) - len(named)
    each = "; ".join(f"{other}, run {pairs}" for other, pairs in named) + f"; and {more} more" * (more > 0)
    return f"{head} those of {len(copies)} campaigns {never}: {each}. Withdraw the copies (monitor withdraw)"


def _named(key: tuple[Any, ...], rows: Sequence[tuple[Any, ...]]) -> tuple[str, str]:
    """A campaign with its machine, where that is another, and the pairs of equal runs."""
    other, its_machine, machine = key
    pairs = [f"{run} (there {same})" for *_, run, same in rows]
    shown = ", ".join(pairs[:MOST_PAIRS]) + ", ..." * (len(pairs) > MOST_PAIRS)
    return f"{other}{'' if machine == its_machine else f' of machine {its_machine}'}", shown
