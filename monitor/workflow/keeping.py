"""Keeping a database for years: audit, verification, backup, restore, export."""

from __future__ import annotations

import re
import secrets
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Literal

import numpy as np

from monitor.documents import OMITTED
from monitor.exceptions import InputError
from monitor.reporting import keeping_messages, messages
from monitor.store import (
    CHANGES,
    AuditEntry,
    Database,
    anchored_entry,
    chain_faults,
    check_workbook_path,
    export_tables,
    export_workbook,
    last_entries,
    not_identified,
    restore,
    tables_without_rows,
    take_backup,
    take_increment,
    unrecorded,
    verify_audit,
)
from monitor.workflow.recomputed import Recomputation, recompute

#: Sheets of a workbook that hold what was identified.
OF_PARAMETERS = ("parameters", "parameters long")
#: Words that entries of the audit are looked through for at once.
_MOST_WORDS = 20


@dataclass(frozen=True)
class VerifyAnswer:
    """Whether the database is as it was written, with the hash of the last audit entry to be noted elsewhere.

    ``anchored_entry`` is the entry that the hash kept elsewhere is of. ``recomputed`` is how many identifications were
    computed anew, of ``recomputable`` that this version made; ``recomputed_of_others`` the same ``of_other_versions``,
    which may have estimated otherwise: ``notes`` say by how much. ``seed`` drew them; None where there was nothing to
    draw. ``signed_certificates`` is how many of the stored documents bear a signature, ``trusted_signatures`` how many
    of these are of a trusted signer; None where nobody was named as such.
    """

    ok: bool
    entries: int
    last_sha256: str
    faults: tuple[str, ...]
    anchored_entry: int | None = None
    recomputed: int = 0
    recomputable: int = 0
    of_other_versions: int = 0
    seed: int | None = None
    signed_certificates: int | None = None
    trusted_signatures: int | None = None
    recomputed_of_others: int = 0
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class VerifyRequest:
    """What is verified besides the database itself.

    ``anchor`` is a hash of the chain that was kept elsewhere: on paper, on a certificate or in a report. ``recompute``
    is how many identifications, drawn at random, are computed anew; ``seed`` draws those of an earlier verification
    again. ``trusted`` is a file of trusted signers (certificates in PEM or DER, or fingerprints): every signed
    certificate has to be of one of them.

    Raises InputError for what is no hash or number.
    """

    anchor: str | None = None
    recompute: int = 3
    trusted: Path | None = None
    seed: int | None = None

    def __post_init__(self) -> None:
        if self.anchor is not None and not re.fullmatch(r"\s*[0-9a-fA-F]{64}\s*", self.anchor):
            raise InputError(f"--anchor {self.anchor}: a hash of the audit has 64 hexadecimal digits")
        if not 0 <= self.recompute < 2**31:
            raise InputError(f"--recompute {self.recompute}: how many identifications, 0 for none")
        if self.seed is not None and not 0 <= self.seed < 2**63:
            raise InputError(f"--seed {self.seed}: a whole number from 0 on, as an earlier verification said")


def verify(db: Database, request: VerifyRequest) -> VerifyAnswer:
    """Hash everything that is stored anew, compare it with the audit, and compute some identifications again.

    Raises InputError for a lake.
    """
    _refuse_lake(db, "verified")
    with db.reading():
        verification = verify_audit(db)
        faults = list(verification.faults)
        entry = None
        if request.anchor is not None:
            anchored = anchored_entry(db, request.anchor)
            entry = None if anchored is None else anchored.entry
            if anchored is None:
                faults.append(keeping_messages.anchor_unknown(request.anchor.strip()))
    # Computed outside: nobody waits for a fit.
    seed = secrets.randbits(32) if request.seed is None else request.seed
    recomputation = (
        recompute(db, np.random.default_rng(seed), request.recompute)
        if request.recompute
        else Recomputation()
    )
    faults += recomputation.faults
    signed = trusted = None
    if request.trusted is not None:
        # What looks at certificates takes longer to load than most databases to verify.
        from monitor.workflow.certificate.signatures import stored_signatures

        findings = dict(stored_signatures(db, request.trusted))
        signed, trusted = len(findings), sum(finding.signer_trusted for finding in findings.values())
        faults += [
            f"certificate {number}: {fault}"
            for number, finding in findings.items()
            for fault in finding.faults
        ]
    return VerifyAnswer(
        not faults,
        verification.entries,
        verification.last_sha256,
        tuple(faults),
        entry,
        recomputation.computed,
        recomputation.of,
        recomputation.of_others,
        seed if request.recompute < recomputation.of + recomputation.of_others else None,
        signed,
        trusted,
        recomputation.computed_of_others,
        recomputation.notes,
    )


def _refuse_lake(db: Database, participle: str) -> None:
    if db.is_lake:
        raise InputError(
            f"{db.path} is a lake of many plants, which is not {participle}: the chain is that of each plant's own "
            "database, and the lake can be made again from these"
        )


@dataclass(frozen=True)
class AuditRequest:
    """How many of the last entries to list, and whether to ``check`` the chain of all.

    ``containing``, words parted by spaces: only entries that hold all of them in time (UTC), actor, action, subject
    or key.

    Raises InputError where ``last`` is not a whole number from 1 on, or there are more than 20 words.
    """

    last: int
    check: bool = False
    containing: str = ""

    def __post_init__(self) -> None:
        if not 0 < self.last < 2**63:
            raise InputError(f"--last {self.last}: how many entries, a whole number from 1 on")
        if len(self.containing.split()) > _MOST_WORDS:
            raise InputError(f"--containing: at most {_MOST_WORDS} words")


@dataclass(frozen=True)
class AuditAnswer:
    """Entries of the audit, the newest first.

    ``faults`` names entries that were edited, removed or put elsewhere, and what is stored without an entry.
    """

    entries: tuple[AuditEntry, ...]
    faults: tuple[str, ...] | None = field(default=None, metadata=OMITTED)


def audit(db: Database, request: AuditRequest) -> AuditAnswer:
    """List the last entries of the audit, the newest first, and what is wrong with the chain where that is asked.

    Raises InputError for a lake, which has the chains of its plants beside each other.
    """
    _refuse_lake(db, "audited")
    entries = last_entries(db, request.last, request.containing.split())
    return AuditAnswer(entries, (*chain_faults(db), *unrecorded(db)) if request.check else None)


@dataclass(frozen=True)
class BackupRequest:
    """The new file that the database is copied to.

    ``incremental``: only what was stored since the newest backup in the same folder, without which it is no backup.
    """

    target: Path
    incremental: bool = False


@dataclass(frozen=True)
class BackupAnswer:
    """The copy with its hash, and how many rows it has in all tables.

    ``first_entry`` and ``last_entry`` are the entries of the audit that it holds, ``follows`` is the name of the backup
    that an incremental one follows. Where nothing was new for an incremental one, there is no ``new_file``, and
    the answer is about the newest backup that is there.
    """

    file: Path
    sha256: str
    rows: int
    message: str
    first_entry: int
    last_entry: int
    follows: str | None = None
    new_file: bool = True


def backup(db: Database, request: BackupRequest) -> BackupAnswer:
    """Copy everything, or what is new, into a second file. Raises StoreError where it exists or cannot be written.

    Raises InputError for a lake, too.
    """
    _refuse_lake(db, "copied")
    copy = (take_increment if request.incremental else take_backup)(db, request.target)
    rows = sum(count for count, _ in copy.tables.values())
    span = copy.span
    assert span is not None  # of those made by this version
    new_file = copy.path == request.target.name
    if not new_file:
        message = keeping_messages.nothing_to_back_up(request.target, copy.path)
    elif span.previous is None:
        message = keeping_messages.backup_made(request.target, len(copy.tables), rows)
    else:
        message = keeping_messages.increment_made(
            request.target, (span.first_entry, span.last_entry), rows, span.previous
        )
    return BackupAnswer(
        file=request.target.with_name(copy.path),
        sha256=copy.sha256,
        rows=rows,
        message=message,
        first_entry=span.first_entry,
        last_entry=span.last_entry,
        follows=span.previous,
        new_file=new_file,
    )


@dataclass(frozen=True)
class RestoreRequest:
    """A backup or a folder of backups, and the new database that is made; ``at`` is the moment whose state is wanted.

    Raises InputError for a moment without its offset from UTC.
    """

    source: Path
    target: Path
    at: datetime | None = None

    def __post_init__(self) -> None:
        if self.at is not None and self.at.utcoffset() is None:
            raise InputError(f"--at {self.at}: name its offset from UTC")


@dataclass(frozen=True)
class RestoreAnswer:
    """The restored database; ``sha256`` is the hash of the backup that it was made from, the last of ``backups``.

    ``last_entry`` is the last entry of its audit and ``faults`` are what its verification found; None and nothing where
    it is a full backup byte for byte.
    """

    file: Path
    sha256: str
    message: str
    backups: tuple[str, ...]
    last_entry: int | None = None
    faults: tuple[str, ...] = ()


def restore_backup(request: RestoreRequest) -> RestoreAnswer:
    """Make a database from a backup. Raises StoreError where the backup is not what its manifest says."""
    restored = restore(request.source, request.target, request.at)
    made_at = restored.backup.made_at[:19].replace("T", " ")
    message = keeping_messages.backup_restored(request.target, made_at, request.at)
    if restored.last_entry is not None:
        message += keeping_messages.restored_up_to(
            restored.last_entry, restored.files, verified=not restored.faults
        )
    return RestoreAnswer(
        request.target,
        restored.backup.sha256,
        message,
        restored.files,
        restored.last_entry,
        restored.faults,
    )


@dataclass(frozen=True)
class ExportRequest:
    """A new or empty folder for the tables, and their format; a workbook (xlsx) may be named itself.

    ``tables`` are the names of the tables that are wanted (default: all, of a workbook those for people), ``machine``
    is the only machine whose rows are written.
    """

    folder: Path
    format: Literal["csv", "parquet", "xlsx"] = "csv"
    tables: tuple[str, ...] | None = None
    machine: str | None = None

    def __post_init__(self) -> None:
        if self.tables is not None and not all(name.strip() for name in self.tables):
            raise InputError("--tables: write names with commas between them, such as parameters,runs")


@dataclass(frozen=True)
class ExportAnswer:
    """The files that were written; ``notes`` say what a workbook lacks because it was not computed yet, and which
    tables that were asked for have no row."""

    files: tuple[Path, ...]
    notes: tuple[str, ...] = ()


def export(db: Database, request: ExportRequest) -> ExportAnswer:
    """Write tables as files or a workbook. Raises InputError for what exists already, NotFoundError, StoreError."""
    if request.format == "xlsx":
        return _workbook(db, request)
    with db.reading():
        written = export_tables(
            db, request.folder, request.format, tables=request.tables, machine=request.machine
        )
        # Of all tables many are empty, which nobody wonders at.
        empty = tables_without_rows(db, request.tables, request.machine) if request.tables is not None else ()
    return ExportAnswer(written, (messages.without_rows(empty, request.machine),) if empty else ())


def _workbook(db: Database, request: ExportRequest) -> ExportAnswer:
    is_file = request.folder.suffix.lower() == ".xlsx"
    file = request.folder if is_file else request.folder / "monitor.xlsx"
    check_workbook_path(file)
    # Loaded here: nothing else of this file computes.
    from monitor.workflow.trend.workbook_changes import workbook_changes

    tables = (*OF_PARAMETERS, CHANGES) if request.tables is None else request.tables
    # Outside of `reading`: nobody waits for a search of years.
    changes = workbook_changes(db, request.machine) if CHANGES in tables else ()
    with db.reading():
        written = export_workbook(db, file, request.tables, request.machine, changes)
    of_parameters = [name for name in (*OF_PARAMETERS, CHANGES) if name in tables]
    lacking = not_identified(db, request.machine) if of_parameters else ()
    return ExportAnswer((written,), (messages.lacks_campaigns(of_parameters, lacking),) if lacking else ())
