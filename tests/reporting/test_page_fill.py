"""How full the pages are, by the places of the texts in the PDF: no page more than half empty, no head left alone."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pypdf
import pytest
from by_path import load

from monitor.reporting.budget import Budget, BudgetLine, DayToDay, HoldsFor, LengthKind, LengthReference
from monitor.reporting.certificate.record import CertificateRecord
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.health.records import MachineHealth
from monitor.reporting.health.render import health_pdf
from monitor.reporting.pdf.render import certificate_pdf, pdf_of

first_page = load("first_page_records", Path(__file__).with_name("test_first_page.py"))
Make = Callable[..., CertificateRecord]
#: Heads and feet stand in the margins, in points.
HEAD, FOOT = 48.0, 45.0
#: Certificates (parameters, maps, language) that `make test` and `make slow` lay out; `make trials` has the others.
QUICK = {(1, 0, "en"), (13, 0, "de")}
SLOW = {(1, 1, "de"), (13, 1, "en"), (51, 0, "en"), (51, 1, "de")}


@dataclass(frozen=True)
class Line:
    """A line of a page: what it says, and its height above the lower edge in points."""

    text: str
    y: float


def lines_of(page: pypdf.PageObject) -> list[Line]:
    """The lines between the margins, from the upper to the lower."""
    pieces: dict[float, list[tuple[float, str]]] = {}

    def note(text: str, current: list[float], matrix: list[float], *_: object) -> None:
        x = matrix[4] * current[0] + matrix[5] * current[2] + current[4]
        y = matrix[4] * current[1] + matrix[5] * current[3] + current[5]
        if text.strip() and FOOT < y < float(page.mediabox.height) - HEAD:
            pieces.setdefault(round(y), []).append((x, text.strip()))

    page.extract_text(visitor_text=note)
    return [Line(" ".join(text for _, text in sorted(pieces[y])), y) for y in sorted(pieces, reverse=True)]


def faults_of(pdf: bytes, heads: tuple[str, ...] = ()) -> list[str]:
    """What is wrong with how a document is spread over its pages; ``heads`` are headings and heads of tables."""
    reader = pypdf.PdfReader(io.BytesIO(pdf))
    faults = []
    for number, page in enumerate(reader.pages, start=1):
        lines = lines_of(page)
        lowest = lines[-1].y / float(page.mediabox.height)
        if lowest > 0.5 and len(reader.pages) > 1:
            faults.append(
                f"page {number} of {len(reader.pages)} is more than half empty: ends at {1 - lowest:.2f}"
            )
        if lines[-1].text.startswith(heads or ("Symbol", "Machine  ")):
            faults.append(f"page {number} ends with the head {lines[-1].text!r}")
    return faults


def with_budget(result: ResultSet, lines: int = 2) -> ResultSet:
    """A result with a budget of so many lines and the days of twenty runs."""
    u = result.u
    sources = ("readings", "scale bar", "lack of fit of the model", "between days")
    each = [BudgetLine(sources[at % 4], u / np.sqrt(lines), 15.0 if at == 0 else None) for at in range(lines)]
    values = dict(zip(result.names, map(float, u), strict=True))
    days = DayToDay(
        20, 5, values, values, values, {name: (0.5 * x, 2.0 * x) for name, x in values.items()},
        {name: 4.0 * x for name, x in values.items()}, (),
    )  # fmt: skip
    reference = LengthReference(LengthKind.NOT_CORRECTED, ("EXX", "EYY", "EZZ"), temperature=21.4)
    return replace(result, budget=Budget(HoldsFor.DAY, tuple(each), days, (), reference))


def _mark(count: int, maps: int, language: str) -> tuple[pytest.MarkDecorator, ...]:
    if (count, maps, language) in QUICK:
        return ()
    return (pytest.mark.slow if (count, maps, language) in SLOW else pytest.mark.all_seeds,)


EVERY = [
    pytest.param(count, maps, language, marks=_mark(count, maps, language))
    for count in (1, 13, 51, 149)
    for maps in (0, 1)
    for language in ("en", "de")
]


@pytest.mark.parametrize(("count", "maps", "language"), EVERY)
def test_no_page_of_a_certificate_is_more_than_half_empty(
    make_record: Make, count: int, maps: int, language: str
) -> None:
    record = make_record(count, language=language, maps=maps)
    assert record.results is not None
    record = replace(record, results=tuple(map(with_budget, record.results)))
    faults = faults_of(certificate_pdf(record), ("Symbol",))
    # Blocks of a correlation matrix of 149 rows are not broken: the page before one may end at 0.44.
    assert len(faults) <= (1 if count == 149 else 0), faults


@pytest.mark.slow
def test_a_certificate_is_set_closer_where_that_saves_its_last_page(make_record: Make) -> None:
    """Fifteen parameters: the last of four pages ended at 0.30, of three at 0.67."""
    record = make_record(15)
    assert record.results is not None
    pdf = certificate_pdf(replace(record, results=tuple(map(with_budget, record.results))))
    assert len(pypdf.PdfReader(io.BytesIO(pdf)).pages) == 3
    assert faults_of(pdf) == []


def of_lengths(count: int) -> list[MachineHealth]:
    """So many machines with 1 to 13 parameters, in every state, so that pages end anywhere."""
    machines = []
    for index in range(count):
        kind = (first_page.GOOD, first_page.CHANGED, first_page.DRIFTED, first_page.AWAY)[index % 4]
        parameters = (kind.parameters or ())[:1] * (1 + 4 * index % 13)
        machines.append(replace(kind, machine=f"Machine {index}", parameters=parameters))
    return machines


@pytest.mark.parametrize(
    "count",
    [
        1,
        *(pytest.param(count, marks=pytest.mark.slow) for count in (2, 3, 5, 12)),
        pytest.param(40, marks=pytest.mark.all_seeds),
    ],
)
def test_no_page_of_a_report_is_more_than_half_empty(count: int) -> None:
    assert faults_of(health_pdf(*first_page.fleet(*of_lengths(count)))) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "rows",
    [pytest.param(rows, marks=pytest.mark.all_seeds if rows % 9 != 1 else ()) for rows in range(1, 80, 3)],
)
def test_a_report_of_any_length_fills_its_last_page(rows: int) -> None:
    machine = replace(first_page.GOOD, parameters=first_page.GOOD.parameters * rows)
    assert faults_of(health_pdf(*first_page.fleet(machine))) == []


def test_the_check_sees_an_empty_page_and_a_head_alone() -> None:
    style = "<style>@page { size: A4; margin: 19mm 17mm } p { break-before: page }</style>"
    html = f"<html lang=en><head><title>x</title>{style}</head><body><h2>Symbol</h2><p>one line</p></body></html>"
    faults = faults_of(pdf_of(html, identifier="x", moment=first_page.LAST.astimezone()), ("Symbol",))
    assert [fault.partition(":")[0] for fault in faults] == [
        "page 1 of 2 is more than half empty",
        "page 1 ends with the head 'Symbol'",
        "page 2 of 2 is more than half empty",
    ]
