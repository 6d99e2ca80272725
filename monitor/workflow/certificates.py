"""Calibration certificates: issued from a run's uncertainty, amended, withdrawn."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any, Literal

from monitor import __version__
from monitor.exceptions import InputError, NotFoundError
from monitor.records import Campaign, LinearAxes
from monitor.reporting.assembly import certificate_record
from monitor.reporting.certificate import CertificateRecord, Replaced
from monitor.reporting.documents import to_document
from monitor.reporting.laboratory import LaboratoryFile, read_laboratory
from monitor.reporting.render import certificate_pdf
from monitor.reporting.signing import Key, sign
from monitor.reporting.texts import ENGLISH, texts_of
from monitor.reporting.volumetric_result import VolumetricResult
from monitor.store import (
    Database,
    StoredModel,
    certificate_numbers,
    load_campaign,
    load_certificate,
    mark_certificate,
    save_certificate,
)
from monitor.workflow.certificate_checks import summary
from monitor.workflow.certificate_files import font_hashes, keep_issued, path_of, prepared, publish
from monitor.workflow.certificate_results import StoredMonteCarlo, results_of, stored_monte_carlo
from monitor.workflow.conformity import statement_of
from monitor.workflow.evaluations import Evaluation, evaluation_of, stored_evaluation
from monitor.workflow.models import as_model, label, resolve

Document = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Wishes:
    """What a certificate states besides the results, and how it is closed.

    ``linear_axes`` are those of `monitor uncertainty`, for a method that takes these axes as known. ``method``: guf,
    or mcm for the stored Monte Carlo result. ``conformity`` names a decision rule; its statement replaces the
    laboratory's word on conformity. ``with_map`` adds the volumetric error. ``key`` signs it. ``fonts`` are files with
    letters that DejaVu Sans lacks. ``replaces`` is the number of the certificate that this one amends, for a
    ``reason``: it says so on paper (ISO/IEC 17025:2017, 7.8.8.3), and the old one is marked with it.
    """

    model: str | None = None
    linear_axes: LinearAxes | None = None
    method: str = "guf"
    draft: bool = False
    conformity: str | None = None
    with_map: bool = False
    key: Key | None = None
    fonts: tuple[Path, ...] = ()
    replaces: str | None = None
    reason: str = ""


def next_number(db: Database, year: int) -> str:
    """The next free number of a year: ``2026-0001``."""
    taken = certificate_numbers(db)
    last = max((int(n[5:]) for n in taken if n.startswith(f"{year}-") and n[5:].isdigit()), default=0)
    return f"{year}-{last + 1:04d}"


def issue(
    db: Database,
    campaign: str,
    run: int | None,
    laboratory: Path,
    *,
    out: Path | None = None,
    number: str | None = None,
    issued_on: date | None = None,
    **wishes: Any,
) -> Document:
    """Issue a certificate for one run: PDF in ``out`` (a folder or a file), record and document in the database.

    ``run`` may be None where the campaign has one run only. ``wishes`` are the fields of ``Wishes``. Raises
    IncompleteCertificateError with the list of what the laboratory's file and the campaign leave open, InputError where
    the campaign states no tolerances or the key does not open.
    """
    wanted = Wishes(**wishes)
    stated = read_laboratory(laboratory)
    loaded = load_campaign(db, campaign)
    day = issued_on or date.today()
    run = _run_of(loaded, run)
    if number is not None:
        _check_number(db, number)
    _check_day(loaded, run, day)
    replaced = None
    if wanted.replaces is not None:
        replaced = _replaced(db, wanted.replaces, wanted.reason, wanted.draft, loaded)
    model = resolve(db, wanted.model, loaded.method)
    found = stored_evaluation(db, loaded, run, model, wanted.linear_axes)
    if found is None:
        found = _evaluated(db, loaded, run, model, wanted.linear_axes)
    chosen = number or next_number(db, day.year)
    path = path_of(out, chosen)
    keep_issued(db, path)
    monte_carlo = stored_monte_carlo(db, found)
    record = _record(stated, found, monte_carlo, wanted, number=chosen, issued_on=day)
    record = dataclasses.replace(record, replaces=replaced)
    inputs = {**_inputs(found, monte_carlo), "fonts": font_hashes(wanted.fonts)}
    if wanted.linear_axes is not None:
        inputs["linear_axes_mm"] = dataclasses.asdict(wanted.linear_axes)
    pdf = certificate_pdf(record, wanted.fonts, inputs)
    if wanted.key is not None:
        pdf = sign(pdf, wanted.key)
    # The file is whole on the disk before the entry is, and gets its name after it: whenever this is killed, no file
    # bears the name of a certificate that the database does not know.
    part = prepared(path, pdf)
    try:
        with db.transaction():
            state: Literal["draft", "issued"] = "draft" if wanted.draft else "issued"
            document = {**to_document(record), "inputs": inputs}
            save_certificate(db, chosen, state, campaign, [run], document, pdf)
            if wanted.replaces is not None:
                mark_certificate(db, wanted.replaces, "amended", wanted.reason, chosen)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    publish(part, path, chosen)
    return {**summary(db, chosen), "file": str(path)}


def _evaluated(
    db: Database, campaign: Campaign, run: int, model: StoredModel, linear_axes: LinearAxes | None
) -> Evaluation:
    """The evaluation of a run that has none in the database."""
    # Solver and compiler take a second to load, for which a stored result need not wait.
    from monitor.workflow.uncertainty import evaluate
    from monitor.workflow.uncertainty_documents import document

    done = evaluate(
        db, campaign.name, run, model=f"{model.name}@{model.version}", method="guf", linear_axes=linear_axes
    )
    return evaluation_of(document(done), campaign, model)


def _run_of(campaign: Campaign, run: int | None) -> int:
    """The run that is certified: the one that was asked for, or the only one. Raises InputError where it is open."""
    known = [one.run for one in campaign.runs]
    if run is None and len(known) == 1:
        return known[0]
    if run is None:
        raise InputError(
            f"campaign {campaign.name} has {len(known)} runs ({min(known)} to {max(known)}): --run N says which "
            "one the certificate is of"
        )
    return run


def _check_number(db: Database, number: str) -> None:
    """Before anything is computed: a number is used once. Raises InputError."""
    try:
        old = load_certificate(db, number)
    except NotFoundError:
        return
    if old.state != "draft":
        raise InputError(
            f"the number {number} is taken, by the {old.state} certificate of campaign {old.campaign}; leave --number "
            "out for the next free one"
        )


def _check_day(campaign: Campaign, run: int, day: date) -> None:
    measured = [one.started_at.date() for one in campaign.runs if one.run == run]
    if measured and day < measured[0]:
        raise InputError(f"run {run} was measured on {measured[0]}; no certificate was issued of it on {day}")


def _record(
    stated: LaboratoryFile,
    found: Evaluation,
    monte_carlo: StoredMonteCarlo | None,
    wanted: Wishes,
    *,
    number: str,
    issued_on: date,
) -> CertificateRecord:
    texts = texts_of(stated.language or ENGLISH)
    result = results_of(found, texts, monte_carlo, wanted.method)
    record = certificate_record(
        stated,
        found.campaign,
        found.run,
        [result],
        number=number,
        issued_on=issued_on,
        model=label(found.model),
        volumetric=[_map(found, result.state)] if wanted.with_map else [],
    )
    if wanted.conformity is not None:
        statement = statement_of(
            result, wanted.conformity, texts, campaign=found.campaign.name, dof=found.dof
        )
        record = dataclasses.replace(record, conformity=statement)
    if wanted.draft and record.title:
        record = dataclasses.replace(record, title=texts("record.draft", title=record.title))
    return record


def _map(found: Evaluation, state: str) -> VolumetricResult:
    # Loaded here: a certificate without a map needs no model fitted.
    from monitor.discovery import fit
    from monitor.methods import method_named
    from monitor.workflow.certificate_map import volumetric_result

    problem = method_named(found.campaign.method).problem_of(found.campaign, as_model(found.model))
    return volumetric_result(found, fit(problem), state)


def _replaced(db: Database, number: str, reason: str, draft: bool, campaign: Campaign) -> Replaced:
    """The certificate to be replaced. Raises InputError where it cannot be replaced by one of ``campaign``."""
    old = load_certificate(db, number)
    if old.state != "issued":
        raise InputError(f"certificate {number} is {old.state}; only an issued one can be replaced")
    if draft:
        raise InputError("a draft replaces nothing; leave --replaces out until it is issued")
    if not reason.strip():
        raise InputError(f"say why certificate {number} is replaced: --reason TEXT")
    if old.machine != campaign.machine.id:
        raise InputError(
            f"campaign {campaign.name} is of machine {campaign.machine.id}, certificate {number} of {old.machine}: "
            "it cannot replace it"
        )
    issued_on = date.fromisoformat(str(old.record["issued_on"]))
    return Replaced(number, issued_on, reason.strip(), old.pdf_sha256)


def _inputs(found: Evaluation, monte_carlo: StoredMonteCarlo | None) -> Document:
    """What the results were computed from: kept with the certificate and inside its PDF."""
    return {
        "campaign": found.campaign.name,
        "run": found.run,
        "files": [{"name": file.name, "sha256": file.sha256} for file in found.campaign.files],
        "model": label(found.model),
        "model_effects": list(found.model.effects),
        # The GUM framework draws no random numbers; the Monte Carlo that it was compared with does.
        "seed": None if monte_carlo is None else monte_carlo.seed,
        # Numbers in v_analyses; None for an evaluation that was made for the certificate.
        "stored_result": found.number,
        "stored_monte_carlo": None if monte_carlo is None else monte_carlo.number,
        "software": f"machine-health-monitor {__version__}",
    }


def amend(
    db: Database, replaces: str, laboratory: Path, reason: str, *, campaign: str | None = None,
    run: int | None = None, **options: Any,
) -> Document:  # fmt: skip
    """Issue a new certificate that replaces another, of the same run unless ``campaign`` and ``run`` are given.

    ``options`` are those of ``issue``. Raises what ``issue`` raises.
    """
    old = load_certificate(db, replaces)
    return issue(
        db,
        campaign or old.campaign,
        old.runs[0] if run is None else run,
        laboratory,
        replaces=replaces,
        reason=reason,
        **options,
    )


def withdraw(db: Database, number: str, reason: str) -> Document:
    """Mark a certificate as withdrawn. Raises InputError where its state does not allow it, NotFoundError."""
    mark_certificate(db, number, "withdrawn", reason)
    return summary(db, number)
