"""The life of certificates: draft, issued, then amended or withdrawn. Entries are added, never changed.

Each entry holds the hash of the entry before it. An issued certificate stays as it is: what follows is an
entry that says it was amended (and by which number it is replaced) or withdrawn, and why.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any, Literal

from monitor import __version__
from monitor.exceptions import DataError, InputError, NotFoundError, TakenNumberError
from monitor.said import reason as said_reason
from monitor.store import audit
from monitor.store.catalogue import campaign_number
from monitor.store.connection import Database, utc_now

if TYPE_CHECKING:
    import pandas as pd

State = Literal["draft", "issued", "amended", "withdrawn"]

#: What may follow on what; None is a number that is not in use yet.
_NEXT: dict[str | None, tuple[State, ...]] = {
    None: ("draft", "issued"),
    "draft": ("draft", "issued", "withdrawn"),
    "issued": ("amended", "withdrawn"),
    "amended": (),
    "withdrawn": (),
}

_COLUMNS = (
    "entry, number, state, campaign_id, runs, record, pdf, pdf_sha256, reason, replaced_by, software_version, "
    "made_at, previous_sha256, entry_sha256"
)


@dataclass(frozen=True)
class StoredCertificate:
    """A certificate in its present state; ``record`` and ``pdf`` are those of its last document.

    ``campaign`` is the name of the campaign that it rests on, ``campaign_id`` its number in the tables:
    ``campaign_withdrawn`` says why where that one no longer counts, and its name may be another's by now.
    """

    number: str
    state: State
    campaign: str
    campaign_id: int
    campaign_withdrawn: str | None
    machine: str
    runs: tuple[int, ...]
    record: Mapping[str, Any]
    pdf: bytes
    pdf_sha256: str
    software_version: str
    made_at: datetime
    reason: str
    replaced_by: str | None


def save_certificate(
    db: Database,
    number: str,
    state: Literal["draft", "issued"],
    campaign: str,
    runs: Sequence[int],
    record: Mapping[str, Any],
    pdf: bytes,
    *,
    unused: bool = False,
) -> None:
    """Keep a document: a draft as often as one likes, an issued one once; ``unused`` asks for a number of its own.

    Raises TakenNumberError where a number that has to be unused is in use by now, InputError where it is issued,
    amended or withdrawn already, DataError for a record that is not JSON, NotFoundError for an unknown campaign.
    """
    if not number.strip():
        raise InputError("a certificate needs a number")
    try:
        text = json.dumps(record, ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError) as fault:
        raise DataError(f"the record of certificate {number} cannot be kept as JSON: {fault}") from fault
    with db.transaction():
        campaign_id = campaign_number(db, campaign)
        if unused and db.rows("SELECT 1 FROM certificate WHERE number = ? LIMIT 1", [number]):
            raise TakenNumberError(f"the number {number} was given to another certificate meanwhile")
        _check_step(db, number, state)
        document = [text, pdf, hashlib.sha256(pdf).hexdigest()]
        _append(db, number, state, campaign_id, [int(run) for run in runs], document, "", None)


def mark_certificate(
    db: Database,
    number: str,
    state: Literal["amended", "withdrawn"],
    reason: str,
    replaced_by: str | None = None,
) -> None:
    """Say that a certificate was amended (``replaced_by`` is the new number) or withdrawn, and why.

    Raises InputError without a reason or a new number, or where the state does not allow it; NotFoundError.
    """
    reason = said_reason(reason, f"certificate {number} can be {state} only with a reason in words")
    with db.transaction():
        old = load_certificate(db, number)
        if state == "amended":
            if replaced_by is None or replaced_by == number:
                raise InputError(f"certificate {number} is amended by one of another number; name it")
            load_certificate(db, replaced_by)
        _check_step(db, number, state)
        _append(db, number, state, old.campaign_id, list(old.runs), [None, None, None], reason, replaced_by)


def load_certificate(db: Database, number: str) -> StoredCertificate:
    """A certificate in its present state, with its last document. Raises NotFoundError listing numbers."""
    entries = db.rows(
        "SELECT state, runs, record, pdf, pdf_sha256, t.software_version, made_at, t.reason, replaced_by, campaign, "
        "campaign_id, w.reason, machine FROM certificate AS t JOIN imported_campaign USING (campaign_id) "
        "LEFT JOIN withdrawn_campaign AS w USING (campaign_id) WHERE number = ? ORDER BY entry",
        [number],
    )
    if not entries:
        numbers = [
            name for (name,) in db.rows("SELECT number FROM v_certificates ORDER BY number DESC LIMIT 20")
        ]
        existing = f"there are {', '.join(numbers)}" if numbers else "none was made yet"
        raise NotFoundError(f"there is no certificate {number!r}; {existing}")
    document = next(entry for entry in reversed(entries) if entry[3] is not None)
    state, runs, _, _, _, _, _, reason, replaced_by, campaign, campaign_id, withdrawn, machine = entries[-1]
    return StoredCertificate(
        number,
        state,
        campaign,
        campaign_id,
        withdrawn,
        machine,
        tuple(runs),
        json.loads(document[2]),
        document[3],
        document[4],
        document[5],
        document[6],
        reason,
        replaced_by,
    )


def list_certificates(db: Database) -> pd.DataFrame:
    """All certificates in their present state: the view ``v_certificates``."""
    return db.frame("SELECT * FROM v_certificates ORDER BY number")


def certificate_numbers(db: Database) -> list[str]:
    """The numbers of all certificates, in order."""
    return [str(number) for (number,) in db.rows("SELECT number FROM v_certificates ORDER BY number")]


def certificates_in_force(db: Database, campaign: str) -> tuple[tuple[str, frozenset[int]], ...]:
    """The issued certificates of a campaign that were neither amended nor withdrawn, by number, with their runs."""
    rows = db.rows(
        "SELECT number, runs FROM v_certificates WHERE campaign_id = ? AND state = 'issued' ORDER BY number",
        [campaign_number(db, campaign)],
    )
    return tuple((str(number), frozenset(runs)) for number, runs in rows)


def find_certificate(db: Database, pdf_sha256: str) -> str | None:
    """The number of the certificate whose document has this hash, None where there is none."""
    numbers = db.rows("SELECT number FROM certificate WHERE pdf_sha256 = ? ORDER BY entry", [pdf_sha256])
    return str(numbers[-1][0]) if numbers else None


def certificate_faults(db: Database) -> tuple[str, ...]:
    """What is wrong with the chain of certificates and their documents; empty where nothing is."""
    faults = []
    previous = audit.NO_ENTRY_BEFORE
    for expected, row in enumerate(db.rows(f"SELECT {_COLUMNS} FROM certificate ORDER BY entry"), start=1):
        *values, entry_sha256 = row
        entry, number, pdf, pdf_sha256 = values[0], values[1], values[6], values[7]
        if entry != expected:
            faults.append(f"certificate entry {expected} is missing")
            break
        if pdf is not None and hashlib.sha256(pdf).hexdigest() != pdf_sha256:
            faults.append(f"the document of certificate {number} was altered")
        if audit.digest(*values) != entry_sha256:
            faults.append(f"certificate entry {expected}, of {number}, was altered")
        if values[-1] != previous:
            faults.append(f"certificate entry {expected}, of {number}, does not follow the one before it")
        previous = entry_sha256
    return tuple(faults)


def _check_step(db: Database, number: str, state: State) -> None:
    last = db.rows("SELECT state FROM certificate WHERE number = ? ORDER BY entry DESC LIMIT 1", [number])
    present = last[0][0] if last else None
    if state not in _NEXT[present]:
        allowed = " or ".join(_NEXT[present])
        raise InputError(
            f"certificate {number} is {present}; "
            + (
                f"it can become {allowed}, not {state}"
                if allowed
                else "that is final, nothing can be changed"
            )
        )


def _append(
    db: Database,
    number: str,
    state: State,
    campaign_id: int,
    runs: list[int],
    document: list[Any],
    reason: str,
    replaced_by: str | None,
) -> None:
    last = db.rows("SELECT entry, entry_sha256 FROM certificate ORDER BY entry DESC LIMIT 1")
    entry, previous = last[0] if last else (0, audit.NO_ENTRY_BEFORE)
    values = [entry + 1, number, state, campaign_id, runs, *document, reason, replaced_by]
    values += [__version__, utc_now(), previous]
    entry_sha256 = audit.digest(*values)
    db.execute(
        f"INSERT INTO certificate ({_COLUMNS}) VALUES (?, ?, ?, ?, ?::BIGINT[], ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        [*values, entry_sha256],
    )
    audit.record(db, state, "certificate", f"{number} entry {entry + 1}", entry_sha256)
