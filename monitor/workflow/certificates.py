"""Calibration certificates: issued from a run's uncertainty, amended, withdrawn."""

from __future__ import annotations

import dataclasses
from datetime import date
from pathlib import Path
from typing import Any

from monitor import __version__
from monitor.exceptions import InputError, NotFoundError
from monitor.records import LinearAxes
from monitor.reporting.assembly import certificate_record
from monitor.reporting.documents import to_document
from monitor.reporting.laboratory import read_laboratory
from monitor.reporting.render import certificate_pdf
from monitor.reporting.signature import sign
from monitor.store import (
    Database,
    list_certificates,
    load_campaign,
    load_certificate,
    mark_certificate,
    save_certificate,
)
from monitor.workflow.certificate_checks import summary
from monitor.workflow.certificate_files import keep_issued, path_of, write_file
from monitor.workflow.certificate_results import results_of
from monitor.workflow.conformity import statement_of
from monitor.workflow.models import label
from monitor.workflow.uncertainty import Evaluated, evaluate

Document = dict[str, Any]


def next_number(db: Database, year: int) -> str:
    """The next free number of a year: ``2026-0001``."""
    taken = [str(number) for number in list_certificates(db)["number"]]
    last = max((int(n[5:]) for n in taken if n.startswith(f"{year}-") and n[5:].isdigit()), default=0)
    return f"{year}-{last + 1:04d}"


def issue(
    db: Database,
    campaign: str,
    run: int,
    laboratory: Path,
    *,
    out: Path | None = None,
    number: str | None = None,
    issued_on: date | None = None,
    model: str | None = None,
    draft: bool = False,
    conformity: str | None = None,
    key: Path | None = None,
    passphrase: str | None = None,
    replaces: str | None = None,
    reason: str = "",
    linear_axes: LinearAxes | None = None,
) -> Document:
    """Issue a certificate for one run: PDF in ``out`` (a folder or a file), record and document in the database.

    ``conformity`` names a decision rule where a statement of conformity is wanted; it replaces the laboratory's
    word on conformity. ``key`` is a PKCS#12 file that signs it, opened by ``passphrase``.
    ``linear_axes`` are those of `monitor uncertainty`, for a method that takes these axes as known.
    ``replaces`` is the number of the certificate that this one amends, for a ``reason``: it says so on paper
    (ISO/IEC 17025:2017, 7.8.8.3), and the old one is marked with it. Raises
    IncompleteCertificateError with the list of what the laboratory's file and the campaign leave open, InputError
    where the campaign states no tolerances or the key does not open.
    """
    stated = read_laboratory(laboratory)
    found = evaluate(db, campaign, run, model=model, method="guf", linear_axes=linear_axes)
    day = issued_on or date.today()
    measured = next(one.started_at.date() for one in found.campaign.runs if one.run == run)
    if day < measured:
        raise InputError(f"run {run} was measured on {measured}; no certificate was issued of it on {day}")
    chosen = number or next_number(db, day.year)
    record = certificate_record(
        stated,
        found.campaign,
        run,
        [results_of(found)],
        number=chosen,
        issued_on=day,
        model=label(found.model),
    )
    if conformity is not None:
        record = dataclasses.replace(record, conformity=statement_of(found, conformity))
    if replaces is not None:
        record = dataclasses.replace(record, replaces=_amendment(db, replaces, reason, draft))
    if draft:
        record = dataclasses.replace(record, title=f"DRAFT, not valid: {record.title}")
    path = path_of(out, chosen)
    keep_issued(db, path)
    inputs = _inputs(found)
    if linear_axes is not None:
        inputs["linear_axes_mm"] = dataclasses.asdict(linear_axes)
    pdf = certificate_pdf(record, inputs=inputs)
    if key is not None:
        pdf = sign(pdf, key, passphrase)
    with db.transaction():
        save_certificate(
            db,
            chosen,
            "draft" if draft else "issued",
            campaign,
            [run],
            {**to_document(record), "inputs": inputs},
            pdf,
        )
        if replaces is not None:
            mark_certificate(db, replaces, "amended", reason, chosen)
        write_file(path, pdf)
    return {**summary(db, chosen), "file": str(path)}


def _amendment(db: Database, replaces: str, reason: str, draft: bool) -> str:
    """The sentence that names the replaced certificate. Raises InputError where it cannot be replaced."""
    old = load_certificate(db, replaces)
    if old.state != "issued":
        raise InputError(f"certificate {replaces} is {old.state}; only an issued one can be replaced")
    if draft:
        raise InputError("a draft replaces nothing; leave --replaces out until it is issued")
    if not reason.strip():
        raise InputError(f"say why certificate {replaces} is replaced: --reason TEXT")
    issued_on = old.record.get("issued_on")
    return f"It replaces certificate {replaces}{f' of {issued_on}' if issued_on else ''}: {reason.strip()}"


def _inputs(found: Evaluated) -> Document:
    """What the results were computed from: kept with the certificate and inside its PDF."""
    return {
        "campaign": found.campaign.name,
        "run": found.run,
        "files": [{"name": file.name, "sha256": file.sha256} for file in found.campaign.files],
        "model": label(found.model),
        "model_effects": list(found.model.effects),
        "seed": None,  # the GUM framework draws no random numbers
        "software": f"machine-health-monitor {__version__}",
    }


def withdraw(db: Database, number: str, reason: str, replaced_by: str | None = None) -> Document:
    """Mark a certificate as withdrawn, or as amended where another number replaces it."""
    if replaced_by is not None and replaced_by not in {str(one) for one in list_certificates(db)["number"]}:
        raise NotFoundError(
            f"there is no certificate {replaced_by} that could replace {number}; issue it first"
        )
    if replaced_by is not None:
        _check_replacement(db, number, replaced_by)
    mark_certificate(db, number, "amended" if replaced_by else "withdrawn", reason, replaced_by)
    return summary(db, number)


def _check_replacement(db: Database, number: str, replaced_by: str) -> None:
    """InputError where a certificate cannot take another's place: not in force, or of another machine."""
    old, new = load_certificate(db, number), load_certificate(db, replaced_by)
    if new.state != "issued":
        raise InputError(
            f"certificate {replaced_by} is {new.state} and cannot replace {number}; issue a new one first"
        )
    machines = [load_campaign(db, one.campaign).machine.id for one in (old, new)]
    if machines[0] != machines[1]:
        raise InputError(
            f"certificate {replaced_by} is of machine {machines[1]}, {number} of {machines[0]}: it cannot replace it"
        )
