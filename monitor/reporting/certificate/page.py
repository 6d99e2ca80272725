"""A complete certificate record as the words and numbers of its template: rounded, with units, in its language."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from monitor.reporting.certificate.behind import PrintedBehind, printed_behind
from monitor.reporting.certificate.completeness import check_complete
from monitor.reporting.certificate.draft_word import draft_word
from monitor.reporting.certificate.grounds import accepted_statements
from monitor.reporting.certificate.machine_frame import PrintedMachineFrame, printed_machine_frame
from monitor.reporting.certificate.matrix import Block, correlation_blocks
from monitor.reporting.certificate.model_effects import PrintedEffects, printed_effects
from monitor.reporting.certificate.pictures import Picture, beside, map_picture, pictures_of
from monitor.reporting.certificate.record import (
    CertificateRecord,
    ConformityStatement,
    MethodUsed,
    NotApplicable,
    Standard,
)
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.certificate.tables import Row, conformity_rows, result_rows, result_widths
from monitor.reporting.certificate.volumetric import POINTS_FILE, printed_map
from monitor.reporting.certificate.words import amendment, answer
from monitor.reporting.numbers import written_factor, written_probability
from monitor.reporting.refused import printed_names, why_refused
from monitor.reporting.texts import Texts, texts_of


@dataclass(frozen=True)
class PrintedResult:
    """One result set as printed."""

    state: str
    k_q: str
    parameter: str
    rows: tuple[Row, ...]
    widths: tuple[float, ...]
    explained: Markup
    machine_frame: PrintedMachineFrame | None
    refused: tuple[Markup, ...]
    half_axes: Markup
    blocks: tuple[Block, ...]
    beside: bool
    pictures: tuple[Picture, ...]
    behind: PrintedBehind | None
    effects: PrintedEffects | None


def certificate_context(record: CertificateRecord) -> dict[str, Any]:
    """Everything that ``certificate.html`` prints. Raises IncompleteCertificateError where an item is missing."""
    check_complete(record)
    assert record.performed_on is not None  # complete: checked above
    assert record.results is not None
    assert record.issued_on is not None
    assert record.method is not None
    texts = texts_of(record.language)
    first, last = (texts.day(day) for day in record.performed_on)
    conformity = record.conformity
    return {
        "record": record,
        "texts": texts,
        "heading": texts.markup("page.number_issued", number=record.number, day=texts.day(record.issued_on)),
        "replaces": amendment(record.replaces, texts),
        "draft_picture": _across_pages(record, texts),
        "accepted": accepted_statements(record.accepted or (), texts),
        "received_on": answer(record.received_on, texts),
        "performed_on": first if first == last else texts("page.from_to", first=first, last=last),
        "method": _method(record.method, texts),
        "references": [(entry.name, answer(entry.certificate, texts)) for entry in record.references or ()],
        "standards": [_standard(entry, texts) for entry in record.standards or ()],
        "results": [_printed(result, texts) for result in record.results],
        "maps": [
            (printed_map(entry, texts), map_picture(entry, texts, POINTS_FILE.format(place=number)))
            for number, entry in enumerate(record.volumetric, start=1)
        ],
        "conformity": conformity_rows(conformity, texts)
        if isinstance(conformity, ConformityStatement)
        else None,
        "statements": [
            (texts("page.sampling"), answer(record.sampling, texts)),
            (texts("page.deviations"), answer(record.deviations, texts)),
            (texts("page.external_results"), answer(record.external_results, texts)),
            (texts("page.adjustment"), answer(record.adjustment, texts)),
            (texts("page.conformity_statement"), answer(conformity, texts)),
            (texts("page.opinions"), answer(record.opinions, texts)),
            (texts("page.validity"), answer(record.relates_only, texts)),
            (texts("page.reproduction"), answer(record.reproduction, texts)),
            *_beside_the_file(record, texts),
        ],
    }


def _across_pages(record: CertificateRecord, texts: Texts) -> str | None:
    """The picture behind every page of a draft; None for a certificate."""
    return draft_word(texts("page.draft")) if record.draft else None


def _beside_the_file(record: CertificateRecord, texts: Texts) -> list[tuple[str, str]]:
    """What somebody needs who checks the file years later: who signs it, and where the audit of the database stood."""
    rows = []
    if record.signer is not None:
        signer = texts("page.signer", name=record.signer.name, sha256=record.signer.sha256)
        rows.append((texts("page.signer_title"), signer))
    if record.anchor is not None:
        anchor = texts("page.anchor", entry=record.anchor.entry, sha256=record.anchor.sha256)
        rows.append((texts("page.anchor_title"), anchor))
    return rows


def _method(method: MethodUsed, texts: Texts) -> list[tuple[str, str]]:
    return [
        (texts("page.method"), method.name or ""),
        (texts("page.procedure"), method.document or ""),
        (texts("page.model"), method.model or ""),
        (texts("page.software"), method.software or ""),
    ]


def _standard(standard: Standard, texts: Texts) -> tuple[str, ...]:
    """A row of the table of standards: what it is, its certificate with issuer and day, and until when it is valid."""
    valid = standard.valid_until
    return (
        standard.name or "",
        standard.identification or "",
        f"{standard.certificate}, {standard.issuer}",
        "" if standard.issued_on is None else texts.day(standard.issued_on),
        valid.statement if isinstance(valid, NotApplicable) else "" if valid is None else texts.day(valid),
    )


def _ellipsoid(result: ResultSet, sign: str) -> tuple[str, str]:
    """The factor and the half-axes of the hyper-ellipsoid; empty where a few days bound none."""
    if not result.has_ellipsoid:
        return "", ""
    axes = (written_factor(axis, sign, result.k_p_error) for axis in result.half_axes)
    return written_factor(result.k_p, sign, result.k_p_error), "; ".join(axes)


def _explained_by(result: ResultSet) -> str:
    """The key of the text that says what U is."""
    if not result.has_ellipsoid:
        return "page.results_explained_intervals"
    return "page.results_explained" if result.sampling is None else "page.results_explained_sampled"


def _printed(result: ResultSet, texts: Texts) -> PrintedResult:
    sign = texts.decimal_sign
    k_q = written_factor(result.k_q, sign, result.k_q_error)
    k_p, half_axes = _ellipsoid(result, sign)
    rows = result_rows(result, texts)
    parameter = texts("page.parameter" if result.machine_frame is None else "page.parameter_referred")
    heads = (
        texts("page.symbol"), parameter, texts("page.estimate"), "u", f"U = {k_q} u", texts("page.unit")
    )  # fmt: skip
    return PrintedResult(
        state=result.state,
        k_q=k_q,
        parameter=parameter,
        rows=rows,
        widths=result_widths(rows, heads),
        explained=texts.markup(
            _explained_by(result),
            k_q=k_q,
            k_p=k_p,
            count=len(result.names),
            rank=result.rank,
            p=written_probability(result.p, sign),
            evaluation=result.evaluation,
        ),
        machine_frame=printed_machine_frame(result.machine_frame, texts),
        refused=tuple(
            texts.markup(
                "page.refused",
                parameters=", ".join(printed_names(refusal.parameters, texts)),
                why=why_refused(refusal, texts),
            )
            for refusal in result.refused
        ),
        half_axes=texts.markup("page.half_axes", half_axes=half_axes) if result.has_ellipsoid else Markup(""),
        blocks=correlation_blocks(
            result.names, result.correlation, texts, texts("page.correlation", state=result.state)
        ),
        beside=beside(result),
        pictures=pictures_of(result, texts),
        behind=printed_behind(result, texts),
        effects=printed_effects(result.effects, texts),
    )
