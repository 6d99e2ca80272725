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
from monitor.store.bookkeeping import earlier_hashes, with_bookkeeping
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
    audited = {}
    imports: Counter[str] = Counter()
    for subject, key, content in db.rows("SELECT subject, key, content_sha256 FROM audit ORDER BY entry"):
        if subject == "campaign":
            imports[key] += 1
            key = _of_several(key, imports[key])
        audited[subject, key] = content
    stored = {(content.subject, content.key): content for content in _contents(db)}
    for subject, key in sorted(audited.keys() | stored.keys()):
        name = f"{subject} {key}"
        if (subject, key) not in stored:
            faults.append(f"{name} is in the audit, but no longer in the database")
        elif (subject, key) not in audited:
            faults.append(f"{name} is in the database, but not in the audit")
        elif not _fits(db, stored[subject, key], audited[subject, key]):
            faults.append(f"{name} was altered after it was stored")
    last = audit.last_anchor(db)
    return Verification(last.entry, last.sha256, tuple(faults))


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
    return audited in content.hashes(db) or audited in content.hashes_of_signed_zeros(db)


def _contents(db: Database) -> Iterator[_Content]:
    imports: Counter[str] = Counter()
    for number, name in db.rows("SELECT campaign_id, campaign FROM imported_campaign ORDER BY campaign_id"):
        imports[name] += 1
        try:
            content = stored_content(db, number)
        except (MonitorError, ValueError, KeyError, TypeError):
            # What can no longer be read was altered, too; the empty hash agrees with nothing.
            content = ""
        yield _Content("campaign", _of_several(name, imports[name]), content, number)
    for model in list_models(db):
        key = model_key(model.name, model.version)
        yield _Content("model", key, model_content(model), key)
    for (number,) in db.rows("SELECT identification_id FROM identification ORDER BY ALL"):
        try:
            content = stored_identification_content(db, number)
        except (MonitorError, ValueError, KeyError, TypeError):
            content = ""
        yield _Content("identification", str(number), content, number)
    for number, content in analysis_contents(db):
        yield _Content("analysis", str(number), content)
    for (number,) in db.rows("SELECT event_id FROM event ORDER BY ALL"):
        yield _Content("event", str(number), event_content(db, number))
    for (number,) in db.rows("SELECT selection_id FROM selection ORDER BY ALL"):
        yield _Content("selection", str(number), selection_content(db, number))
    for (number,) in db.rows("SELECT choice_id FROM machine_model ORDER BY ALL"):
        yield _Content("machine model", str(number), machine_model_content(db, number))
    for (number,) in db.rows("SELECT refusal_id FROM refused_import ORDER BY ALL"):
        yield _Content("refused import", str(number), refusal_content(db, number))
    for (number,) in db.rows("SELECT refusal_id FROM refusal_cleared ORDER BY ALL"):
        yield _Content("cleared refusal", str(number), cleared_content(db, number))
    for (number,) in db.rows("SELECT DISTINCT campaign_id FROM import_note ORDER BY ALL"):
        yield _Content("import notes", str(number), notes_content(db, number))
    for (number,) in db.rows("SELECT campaign_id FROM withdrawn_campaign ORDER BY ALL"):
        yield _Content("withdrawn campaign", str(number), withdrawal_content(db, number))
    for number, entry, content in db.rows(
        "SELECT number, entry, entry_sha256 FROM certificate ORDER BY entry"
    ):
        yield _Content("certificate", f"{number} entry {entry}", content)


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
