"""Calibration certificates: issued from a run's uncertainty, amended, withdrawn."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any, Literal

from monitor.documents import to_document
from monitor.records import LinearAxes
from monitor.reporting.certificate.assembly import certificate_record
from monitor.reporting.certificate.laboratory import LaboratoryFile, read_laboratory
from monitor.reporting.certificate.record import CertificateRecord
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.certificate.volumetric_result import VolumetricResult
from monitor.reporting.pdf.render import certificate_pdf
from monitor.reporting.signature.signing import Key, sign
from monitor.reporting.texts import ENGLISH, texts_of
from monitor.store import (
    Database,
    load_campaign,
    load_certificate,
    mark_certificate,
    save_certificate,
)
from monitor.workflow.certificate.checks import summary
from monitor.workflow.certificate.conformity import statement_of
from monitor.workflow.certificate.files import keep_issued, path_of, prepared, publish
from monitor.workflow.certificate.orders import (
    check_adjustment,
    check_day,
    check_number,
    measured_runs,
    next_number,
    replaced_by,
    runs_of,
)
from monitor.workflow.certificate.parts import Part, inputs_of, part_of
from monitor.workflow.certificate.results import results_of
from monitor.workflow.models import label, resolve

Document = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Wishes:
    """What a certificate states besides the results, and how it is closed.

    ``linear_axes`` are those of `monitor uncertainty`, for a method that takes these axes as known. ``method``: guf,
    or mcm for the stored Monte Carlo result. ``conformity`` names a decision rule; its statement replaces the
    laboratory's word on conformity. ``with_map`` adds the volumetric error. ``key`` signs it. ``fonts`` are files with
    letters that DejaVu Sans lacks. ``replaces`` is the number of the certificate that this one amends, for a
    ``reason``: it says so on paper (ISO/IEC 17025:2017, 7.8.8.3), and the old one is marked with it. ``as_left`` is the
    run that was measured after an adjustment or repair: its results stand beside those as found (7.8.4.1 d), or alone.
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
    as_left: int | None = None


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

    ``run`` may be None where the campaign has one run only, or where ``as_left`` names the only one that is certified.
    ``wishes`` are the fields of ``Wishes``. Raises
    IncompleteCertificateError with the list of what the laboratory's file and the campaign leave open, InputError where
    the campaign states no tolerances or the key does not open.
    """
    wanted = Wishes(**wishes)
    stated = read_laboratory(laboratory)
    loaded = load_campaign(db, campaign)
    now = today()
    day = issued_on or now
    measured = measured_runs(loaded, run, wanted.as_left)
    if number is not None:
        check_number(db, number)
    check_day(loaded, measured, day, day if wanted.draft else now)
    check_adjustment(stated, measured)
    replaced = None
    if wanted.replaces is not None:
        replaced = replaced_by(db, wanted.replaces, wanted.reason, wanted.draft, loaded)
    chosen = number or next_number(db, day.year)
    path = path_of(out, chosen)
    keep_issued(db, path)
    model = resolve(db, wanted.model, loaded.method)
    parts = [part_of(db, loaded, model, one, wanted.linear_axes) for one in measured]
    record = _record(stated, parts, wanted, number=chosen, issued_on=day)
    record = dataclasses.replace(record, replaces=replaced)
    inputs = inputs_of(parts, wanted.linear_axes, wanted.fonts)
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
            save_certificate(db, chosen, state, campaign, [one.run for one in measured], document, pdf)
            if wanted.replaces is not None:
                mark_certificate(db, wanted.replaces, "amended", wanted.reason, chosen)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    publish(part, path, chosen)
    return {**summary(db, chosen), "file": str(path)}


def today() -> date:
    """The present day by the clock of this computer."""
    return date.today()


def _record(
    stated: LaboratoryFile, parts: Sequence[Part], wanted: Wishes, *, number: str, issued_on: date
) -> CertificateRecord:
    texts = texts_of(stated.language or ENGLISH)
    results = [
        results_of(one.found, texts, one.monte_carlo, wanted.method, state=texts(one.measured.text))
        for one in parts
    ]
    last = parts[-1].found
    record = certificate_record(
        stated,
        last.campaign,
        [one.measured.run for one in parts],
        results,
        number=number,
        issued_on=issued_on,
        model=label(last.model),
        volumetric=_maps(parts, results) if wanted.with_map else [],
    )
    if wanted.conformity is not None:
        # Of the state in which the machine is handed back.
        statement = statement_of(
            results[-1], wanted.conformity, texts, campaign=last.campaign.name, dof=last.dof
        )
        record = dataclasses.replace(record, conformity=statement)
    if wanted.draft and record.title:
        record = dataclasses.replace(record, title=texts("record.draft", title=record.title))
    return record


def _maps(parts: Sequence[Part], results: Sequence[ResultSet]) -> list[VolumetricResult]:
    # Loaded here: a certificate without a map waits for no solver.
    from monitor.workflow.certificate.map import volumetric_result

    return [volumetric_result(one.found, result.state) for one, result in zip(parts, results, strict=True)]


def amend(
    db: Database, replaces: str, laboratory: Path, reason: str, *, campaign: str | None = None,
    run: int | None = None, **options: Any,
) -> Document:  # fmt: skip
    """Issue a new certificate that replaces another, of the same runs unless ``run`` or ``as_left`` is given.

    ``options`` are those of ``issue``. Raises what ``issue`` raises.
    """
    old = load_certificate(db, replaces)
    as_left = options.pop("as_left", None)
    if run is None and as_left is None:
        run, as_left = runs_of(old.record, old.runs)
    return issue(
        db,
        campaign or old.campaign,
        run,
        laboratory,
        replaces=replaces,
        reason=reason,
        as_left=as_left,
        **options,
    )


def withdraw(db: Database, number: str, reason: str) -> Document:
    """Mark a certificate as withdrawn. Raises InputError where its state does not allow it, NotFoundError."""
    mark_certificate(db, number, "withdrawn", reason)
    return summary(db, number)
