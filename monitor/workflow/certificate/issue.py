"""Calibration certificates: issued from a run's uncertainty, amended, withdrawn."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable, Sequence
from datetime import date
from typing import Literal

from monitor.documents import to_document
from monitor.exceptions import InputError, TakenNumberError
from monitor.methods import method_named
from monitor.records import VOLUMETRIC
from monitor.reporting import messages, record_messages
from monitor.reporting.certificate.assembly import CertificateIdentity, certificate_record
from monitor.reporting.certificate.completeness import RefusedGroundsError, missing_items
from monitor.reporting.certificate.dcc_elements import NEWEST
from monitor.reporting.certificate.laboratory import LaboratoryFile, read_laboratory
from monitor.reporting.certificate.model_effect import ModelEffect
from monitor.reporting.certificate.record import CertificateRecord, NotApplicable
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.certificate.volumetric_result import VolumetricResult
from monitor.reporting.pdf.beside import certificate_pdf
from monitor.reporting.signature.signing import sign, signer_of
from monitor.reporting.texts import ENGLISH, Texts, texts_of
from monitor.store import (
    Database,
    certificates_in_force,
    last_anchor,
    load_certificate,
    mark_certificate,
    save_certificate,
)
from monitor.workflow.certificate.answer import CertificateFileAnswer, CertificateState
from monitor.workflow.certificate.certified import (
    CertifiedRun,
    certified_run,
    inputs_of,
    refuse_without_region,
)
from monitor.workflow.certificate.conformity import statement_of
from monitor.workflow.certificate.copies import copied_grounds
from monitor.workflow.certificate.effects import effects_of
from monitor.workflow.certificate.files import finish_left, keep_issued, path_of, prepared, publish
from monitor.workflow.certificate.grounds import grounds_against, judged_grounds
from monitor.workflow.certificate.inputs import CertificateInputs
from monitor.workflow.certificate.orders import (
    Measured,
    check_adjustment,
    check_day,
    check_number,
    measured_runs,
    next_number,
    replaced_by,
    runs_of,
)
from monitor.workflow.certificate.request import AmendmentRequest, CertificateRequest, WithdrawalRequest
from monitor.workflow.certificate.results import results_of
from monitor.workflow.certificate.states import state_of
from monitor.workflow.measured import machine_campaign
from monitor.workflow.models import label, resolve_for
from monitor.workflow.uncertainty.lack_in_budget import lack_in_budget
from monitor.workflow.uncertainty.stored import stored_uncertainty


def issue(db: Database, request: CertificateRequest) -> CertificateFileAnswer:
    """Issue a certificate: the PDF as a file, record and document in the database.

    Raises IncompleteCertificateError with the list of what the laboratory's file and the campaign leave open,
    RefusedGroundsError with the grounds that speak against it and are not accepted, and what is left open besides;
    InputError where the campaign states no tolerances or the key does not open.
    """
    stated = read_laboratory(request.laboratory)
    campaign = machine_campaign(db, request.campaign, "certificate issue", lambda method: method.certificate)
    present = today()
    day = request.issued_on or present
    measured = measured_runs(campaign, request.run, request.as_left)
    if request.number is not None:
        check_number(db, request.number)
    check_day(campaign, measured, day, day if request.draft else present)
    check_adjustment(stated, measured)
    replaced = None
    if request.replaces is not None:
        replaced = replaced_by(db, request.replaces, request.reason, request.draft, campaign)
    in_force = _in_force(db, request, measured)
    keep_issued(db, path_of(request.out, request.number or next_number(db, day.year)))
    model = resolve_for(db, request.model, campaign.method, campaign.machine.id)
    stored = {run.run: stored_uncertainty(db, campaign, run.run, model, request.asked) for run in measured}
    grounds = (*copied_grounds(db, campaign), *grounds_against(campaign, model, stored))
    runs = [certified_run(db, campaign, model, run, request.asked, stored[run.run]) for run in measured]
    lack = (ground for run in runs for ground in lack_in_budget(run.evaluated.answer))
    accepted, refused = judged_grounds(tuple(dict.fromkeys((*grounds, *lack))), request.accept)
    refuse_without_region(db, campaign, model, runs, request.asked)
    inputs = inputs_of(runs, request.asked, request.fonts)
    effects = [effects_of(db, run.evaluated) for run in runs]

    signer = None if request.key is None else signer_of(request.key)

    def recorded(number: str) -> CertificateRecord:
        identity = CertificateIdentity(
            number, day, label(runs[-1].evaluated.model),
            method_name=_method_name(campaign.method, texts_of(stated.language or ENGLISH)),
        )  # fmt: skip
        record = _record(stated, runs, effects, request, identity)
        return dataclasses.replace(
            record,
            replaces=replaced,
            accepted=accepted or None,
            anchor=last_anchor(db),
            signer=signer,
            dcc_version=_dcc_version(request, stated),
        )

    if refused:
        # Who has to answer for it hears at once what else is missing.
        raise RefusedGroundsError(
            refused, missing_items(recorded(request.number or next_number(db, day.year)))
        )
    written = _numbered(db, request, recorded, inputs, day.year)
    return dataclasses.replace(written, notes=(*in_force, *_not_printed(request, stated)) or None)


def _in_force(db: Database, request: CertificateRequest, measured: Sequence[Measured]) -> tuple[str, ...]:
    """Which certificates of the same runs are in force besides the one that is amended."""
    runs = {of.run for of in measured}
    numbers = [
        number
        for number, certified in certificates_in_force(db, request.campaign)
        if certified & runs and number not in (request.replaces, request.number)
    ]
    return (record_messages.certificates_in_force(request.campaign, numbers),) if numbers else ()


def _not_printed(request: CertificateRequest, stated: LaboratoryFile) -> tuple[str, ...]:
    """What the laboratory says of conformity, where a statement by a rule stands in its place."""
    said = stated.conformity
    if request.conformity is None or said is None:
        return ()
    if isinstance(said, NotApplicable):
        return (messages.conformity_asked_for_after_all(request.conformity, said.statement),)
    return (messages.conformity_replaced(request.conformity, said),)


def _numbered(
    db: Database, request: CertificateRequest, recorded: Callable[[str], CertificateRecord],
    inputs: CertificateInputs, year: int,
) -> CertificateFileAnswer:  # fmt: skip
    """Issue the record of the wanted number, or of the next one of the year that is free when it is stored."""
    for _ in range(_NUMBERS):
        # Nobody waits while a page is rendered; whoever was quicker has the number, and this one takes the next.
        with contextlib.suppress(TakenNumberError):
            return _issued(db, request, recorded(request.number or next_number(db, year)), inputs)
    raise InputError(
        f"{_NUMBERS} free numbers in turn were given to other certificates; type the command again"
    )


#: How often another certificate may take the number that was free when this one was rendered.
_NUMBERS = 50


def _issued(
    db: Database, request: CertificateRequest, record: CertificateRecord, inputs: CertificateInputs
) -> CertificateFileAnswer:
    """Render a record, sign it, store it and give its file its name. Raises TakenNumberError, InputError."""
    number = str(record.number)
    path = path_of(request.out, number)
    finish_left(db, path.parent)
    keep_issued(db, path)
    pdf = certificate_pdf(record, request.fonts, to_document(inputs))
    if request.key is not None:
        pdf = sign(pdf, request.key, request.timestamp_url, request.long_term)
    # The file is whole on the disk before the entry is, and gets its name after it: whenever this is killed, no file
    # bears the name of a certificate that the database does not know.
    part = prepared(path, pdf)
    try:
        _save(db, request, record, inputs, pdf)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    publish(part, path, number)
    return CertificateFileAnswer(state_of(load_certificate(db, number)), str(path))


def today() -> date:
    """The present day by the clock of this computer."""
    return date.today()


def _save(
    db: Database,
    request: CertificateRequest,
    record: CertificateRecord,
    inputs: CertificateInputs,
    pdf: bytes,
) -> None:
    """Store record and document, and mark the certificate that it replaces, all or nothing."""
    state: Literal["draft", "issued"] = "draft" if request.draft else "issued"
    document = {**to_document(record), "inputs": to_document(inputs)}
    runs = [inputs.run.run] if inputs.as_left is None else [inputs.run.run, inputs.as_left.run]
    with db.transaction():
        save_certificate(
            db,
            str(record.number),
            state,
            request.campaign,
            runs,
            document,
            pdf,
            unused=request.number is None,
        )
        if request.replaces is not None:
            mark_certificate(db, request.replaces, "amended", request.reason, record.number)


def _dcc_version(request: CertificateRequest, stated: LaboratoryFile) -> str | None:
    """The release of the digital certificate; None where there is none, because the laboratory names no country."""
    if stated.country is None:
        return None
    return str(request.dcc_version or stated.dcc_version or NEWEST)


def _method_name(name: str, texts: Texts) -> str:
    """The name of a method as people read it, in the certificate's language where that has one, and as campaigns write
    it."""
    title = texts.sentences.get(f"methods.{name}", method_named(name).title)
    return f"{title} ({name})"


def _record(
    stated: LaboratoryFile,
    runs: Sequence[CertifiedRun],
    effects: Sequence[tuple[ModelEffect, ...] | None],
    request: CertificateRequest,
    identity: CertificateIdentity,
) -> CertificateRecord:
    texts = texts_of(stated.language or ENGLISH)
    results = [
        results_of(run.evaluated, texts, run.monte_carlo, request.method, state=texts(run.measured.text))
        for run in runs
    ]
    results = [
        dataclasses.replace(result, effects=of_run) for result, of_run in zip(results, effects, strict=True)
    ]
    last = runs[-1].evaluated
    record = certificate_record(
        stated,
        last.campaign,
        [run.measured.run for run in runs],
        results,
        identity,
        _maps(runs, results) if request.with_map else (),
    )
    if request.conformity is not None:
        # Of the state in which the machine is handed back.
        statement = statement_of(
            results[-1],
            request.conformity,
            texts,
            campaign=last.campaign.name,
            freedoms={
                **dict(zip(last.names, map(float, last.dof_by_parameter), strict=True)),
                VOLUMETRIC: last.fewest_dof,
            },
            stated=last.campaign.machine.tolerances,
            volumetric=record.volumetric[-1] if record.volumetric else None,
            process=request.process,
        )
        record = dataclasses.replace(record, conformity=statement)
    if request.draft and record.title:
        record = dataclasses.replace(record, title=texts("record.draft", title=record.title), draft=True)
    return record


def _maps(runs: Sequence[CertifiedRun], results: Sequence[ResultSet]) -> list[VolumetricResult]:
    # Loaded here: a certificate without a map waits for no solver.
    from monitor.workflow.certificate.map import volumetric_result

    return [volumetric_result(run.evaluated, result.state) for run, result in zip(runs, results, strict=True)]


def amend(db: Database, request: AmendmentRequest) -> CertificateFileAnswer:
    """Issue a new certificate that replaces another. Raises what ``issue`` raises."""
    old = load_certificate(db, request.replaces)
    run, as_left = request.run, request.as_left
    if run is None and as_left is None:
        run, as_left = runs_of(old)
    return issue(db, request.certificate(request.campaign or old.campaign, run, as_left))


def withdraw(db: Database, request: WithdrawalRequest) -> CertificateState:
    """Mark a certificate as withdrawn. Raises InputError where its state does not allow it, NotFoundError."""
    mark_certificate(db, request.number, "withdrawn", request.reason)
    return state_of(load_certificate(db, request.number))
