"""Verification that the database is as it was written: everything is hashed anew and compared with the audit.

Seen are: an altered, added or removed row of any result, campaign or file; an altered or missing audit entry,
those at the end included as long as what they record is there. Not seen is a database put back as a whole to
an earlier state: keep the last hash (``Verification.last_sha256``) elsewhere, for example on paper.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from monitor.exceptions import MonitorError
from monitor.store import audit
from monitor.store.analyses import analysis_contents
from monitor.store.archiving import archived_hashes
from monitor.store.bookkeeping import earlier_hashes, hashes_of_fewer_books, with_bookkeeping
from monitor.store.campaigns import stored_content
from monitor.store.certificates import certificate_faults
from monitor.store.connection import Database
from monitor.store.events import event_content
from monitor.store.identifications import stored_identification_content
from monitor.store.import_notes import notes_content
from monitor.store.indexes import index_faults
from monitor.store.machine_models import machine_model_content
from monitor.store.models import list_models, model_content, model_key
from monitor.store.past.campaign_runs import run_list_faults
from monitor.store.refusals import cleared_content, refusal_content
from monitor.store.schema import schema_faults
from monitor.store.selections import selection_content
from monitor.store.withdrawals import withdrawal_content
from monitor.store.withdrawn_events import withdrawn_event_content


@dataclass(frozen=True)
class Verification:
    """Result of a verification: the number of audit entries, the hash of the last, and a sentence for every fault."""

    entries: int
    last_sha256: str
    faults: tuple[str, ...]

    @property
    def ok(self) -> bool:
        """Whether there is no fault."""
        return not self.faults


def verify_audit(db: Database) -> Verification:
    """Hash everything anew and compare it with the audit; takes as long as reading the whole database."""
    faults = [
        *audit.chain_faults(db),
        *certificate_faults(db),
        *_file_faults(db),
        *_machine_faults(db),
        *run_list_faults(db),
        *index_faults(db),
        *schema_faults(db),
    ]
    audited = _audited(db)
    stored = {(content.subject, content.key): content for content in _contents(db)}
    # What another session stored meanwhile has its entry by now, and is for the next verification.
    for recorded in _audited(db).keys() - audited.keys():
        stored.pop(recorded, None)
    for subject, key in sorted(audited.keys() | stored.keys()):
        name = f"{subject} {key}"
        if (subject, key) not in stored:
            faults.append(f"{name} is in the audit, but no longer in the database")
        elif (subject, key) not in audited:
            faults.append(_without_entry(subject, key))
        elif not _fits(db, stored[subject, key], audited[subject, key]):
            faults.append(f"{name} was altered after it was stored")
    last = audit.last_anchor(db)
    return Verification(last.entry, last.sha256, tuple(faults))


def unrecorded(db: Database) -> tuple[str, ...]:
    """Return a sentence for everything that is stored without an entry of the audit: entries cut off at the end.

    Nothing is hashed; what was cut off with all that it records leaves no trace but a hash kept elsewhere.
    """
    # In this order: what another session stores in between has its entry already.
    keys = sorted(_keys(db))
    audited = _audited(db)
    return tuple(_without_entry(subject, key) for subject, key, _ in keys if (subject, key) not in audited)


def _audited(db: Database) -> dict[tuple[str, str], str]:
    """Return the hash of the content of each subject and key that the audit names last."""
    audited = {}
    imports: Counter[str] = Counter()
    for subject, key, content in db.rows("SELECT subject, key, content_sha256 FROM audit ORDER BY entry"):
        if subject == "campaign":
            imports[key] += 1
            key = _of_several(key, imports[key])
        audited[subject, key] = content
    return audited


def _without_entry(subject: str, key: str) -> str:
    return f"{subject} {key} is in the database, but not in the audit"


@dataclass(frozen=True)
class _Content:
    """What is stored of a subject of the audit: its key there, its number in the tables, the hash of its content."""

    subject: str
    key: str
    sha256: str
    number: int | str = ""

    def hashes(self, db: Database) -> tuple[str, ...]:
        """Return the hashes that an entry may hold: with the books, and as before without; none of the unreadable."""
        return self._with_books(db, self.sha256) if self.sha256 else ()

    def hashes_of_signed_zeros(self, db: Database) -> tuple[str, ...]:
        """Return the same with zeros as they are signed, as versions before 0.2.0 hashed readings and results."""
        if not self.sha256 or self.subject not in _OF_NUMBERS:
            return ()
        return self._with_books(db, _OF_NUMBERS[self.subject](db, int(self.number), signed_zeros=True))

    def _with_books(self, db: Database, content: str) -> tuple[str, ...]:
        books = self.subject, self.number, content
        return with_bookkeeping(db, *books), *earlier_hashes(db, *books)


#: Subjects whose content is mostly numbers, and the function that hashes them.
_OF_NUMBERS: Mapping[str, Callable[..., str]] = {
    "campaign": stored_content,
    "identification": stored_identification_content,
}


def _fits(db: Database, content: _Content, audited: str) -> bool:
    """Whether what is stored of a subject has the hash in the audit."""
    return (
        audited in content.hashes(db)
        or audited in content.hashes_of_signed_zeros(db)
        or audited in hashes_of_fewer_books(db, content.subject, content.number, content.sha256)
    )


#: Of each subject of the audit: the numbers under which its rows are stored.
_NUMBERS: Mapping[str, str] = {
    "identification": "SELECT identification_id FROM identification",
    "analysis": "SELECT DISTINCT analysis_id FROM analysis",
    "event": "SELECT event_id FROM event",
    "withdrawn event": "SELECT event_id FROM withdrawn_event",
    "selection": "SELECT selection_id FROM selection",
    "machine model": "SELECT choice_id FROM machine_model",
    "refused import": "SELECT refusal_id FROM refused_import",
    "cleared refusal": "SELECT refusal_id FROM refusal_cleared",
    "import notes": "SELECT DISTINCT campaign_id FROM import_note",
    "withdrawn campaign": "SELECT campaign_id FROM withdrawn_campaign",
}
#: How the content of a subject with a number is hashed; analyses are, many at once.
_HASHES: Mapping[str, Callable[[Database, int], str]] = {
    "campaign": stored_content,
    "identification": stored_identification_content,
    "event": event_content,
    "withdrawn event": withdrawn_event_content,
    "selection": selection_content,
    "machine model": machine_model_content,
    "refused import": refusal_content,
    "cleared refusal": cleared_content,
    "import notes": notes_content,
    "withdrawn campaign": withdrawal_content,
}


def _keys(db: Database) -> Iterator[tuple[str, str, int]]:
    """Yield subject, key in the audit and number of everything that is stored; 0 for what has another name."""
    imports: Counter[str] = Counter()
    for number, name in db.rows("SELECT campaign_id, campaign FROM imported_campaign ORDER BY campaign_id"):
        imports[name] += 1
        yield "campaign", _of_several(name, imports[name]), number
    for subject, numbers in _NUMBERS.items():
        for (number,) in db.rows(f"{numbers} ORDER BY ALL"):
            yield subject, str(number), number
    for model, version in db.rows("SELECT model, version FROM model ORDER BY ALL"):
        yield "model", model_key(model, version), 0
    for number, entry in db.rows("SELECT number, entry FROM certificate ORDER BY entry"):
        yield "certificate", f"{number} entry {entry}", 0


def _contents(db: Database) -> Iterator[_Content]:
    for model in list_models(db):
        key = model_key(model.name, model.version)
        yield _Content("model", key, model_content(model), key)
    for number, content in analysis_contents(db):
        yield _Content("analysis", str(number), content)
    for number, entry, content in db.rows("SELECT number, entry, entry_sha256 FROM certificate"):
        yield _Content("certificate", f"{number} entry {entry}", content)
    for subject, key, number in _keys(db):
        if subject not in _HASHES:
            continue
        try:
            content = _HASHES[subject](db, number)
        except (MonitorError, ValueError, KeyError, TypeError):
            # What can no longer be read was altered, too; the empty hash agrees with nothing.
            content = ""
        yield _Content(subject, key, content, number)


def _of_several(name: str, nth: int) -> str:
    """The key of the nth import of a campaign's name: a name is free again once its campaign is withdrawn."""
    return name if nth == 1 else f"{name} (import {nth} of that name)"


def _file_faults(db: Database) -> Iterator[str]:
    archived = archived_hashes(db)
    for campaign_id, campaign, file, content, sha256 in db.rows(
        "SELECT campaign_id, campaign, file, content, sha256 FROM source_file JOIN imported_campaign "
        "USING (campaign_id) ORDER BY ALL"
    ):
        if not content and archived.get((campaign_id, file)) == sha256:
            continue
        if hashlib.sha256(content).hexdigest() != sha256:
            yield f"the file {file} of campaign {campaign} was altered after it was imported"


def _machine_faults(db: Database) -> Iterator[str]:
    for campaign, machine in db.rows(
        "SELECT campaign, machine FROM imported_campaign AS c WHERE method <> 'curve' AND NOT EXISTS ("
        "SELECT 1 FROM registered_machine AS r WHERE r.machine = c.machine "
        "AND r.topology = (c.machine_description ->> 'topology')) "
        "OR machine IS DISTINCT FROM (machine_description ->> 'id') ORDER BY ALL"
    ):
        yield f"machine {machine} was altered: it differs from its description in campaign {campaign}"
