"""A complete certificate record as the words and numbers of its template: rounded and with units."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date
from decimal import Decimal
from typing import Any

from monitor.records import Array
from monitor.reporting.certificate import (
    CertificateRecord,
    ConformityStatement,
    MethodUsed,
    NotApplicable,
    check_complete,
)
from monitor.reporting.certificate_pictures import Picture, pictures_of
from monitor.reporting.numbers import (
    PLUS_MINUS,
    decimal_of,
    round_result,
    round_to_place,
    round_uncertainty,
    written,
    written_correlation,
    written_factor,
    written_probability,
)
from monitor.reporting.results import ResultSet

#: Columns of the correlation matrix that stand side by side; a wider matrix is broken into blocks.
CORRELATION_COLUMNS = 15
#: Longer names do not fit above a column of the matrix.
_LONGEST_COLUMN_NAME = 6
#: Width of a digit and of the decimal point in DejaVu Sans, in em (1303 and 651 of 2048 units).
_DIGIT_EM, _POINT_EM = 1303 / 2048, 651 / 2048
#: The darkest grey behind a correlation coefficient: dark letters stay readable on it (contrast above 7).
_DARKEST = 0.38


@dataclass(frozen=True)
class Number:
    """A number as printed, and the room behind it (in em) that puts its decimal sign below the others'."""

    text: str
    room: float


@dataclass(frozen=True)
class Row:
    """One parameter as printed: estimate, standard and expanded uncertainty."""

    name: str
    description: str
    numbers: tuple[Number, Number, Number]
    unit: str


@dataclass(frozen=True)
class Cell:
    """A correlation coefficient and the grey behind it (0 white to 1 black)."""

    text: str
    grey: float


@dataclass(frozen=True)
class Block:
    """A part of the correlation matrix: its column names and rows of (name, cells)."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, tuple[Cell, ...]], ...]
    numbered: bool


@dataclass(frozen=True)
class PrintedResult:
    """One result set as printed."""

    state: str
    rows: tuple[Row, ...]
    refused: tuple[tuple[str, str], ...]
    count: int
    rank: int
    p: str
    k_q: str
    k_p: str
    evaluation: str
    half_axes: str
    blocks: tuple[Block, ...]
    pictures: tuple[Picture, ...]


def certificate_context(record: CertificateRecord) -> dict[str, Any]:
    """Everything that ``certificate.html`` prints. Raises IncompleteCertificateError where an item is missing."""
    check_complete(record)
    assert record.performed_on is not None  # complete: checked above
    assert record.results is not None
    assert record.issued_on is not None
    assert record.method is not None
    first, last = record.performed_on
    return {
        "record": record,
        "received_on": _answer(record.received_on),
        "performed_on": _day(first) if first == last else f"{_day(first)} to {_day(last)}",
        "issued_on": _day(record.issued_on),
        "method": _method(record.method),
        "references": [
            (reference.name, _answer(reference.certificate)) for reference in record.references or ()
        ],
        "results": [_printed(result) for result in record.results],
        "conformity": _conformity(record.conformity),
        "statements": [
            ("Sampling", _answer(record.sampling)),
            ("Deviations from the method", _answer(record.deviations)),
            ("External results", _answer(record.external_results)),
            ("Before and after adjustment", _answer(record.adjustment)),
            ("Conformity", _answer(record.conformity)),
            ("Opinions and interpretations", _answer(record.opinions)),
            ("Validity", _answer(record.relates_only)),
            ("Reproduction", _answer(record.reproduction)),
        ],
    }


def _answer(value: str | date | NotApplicable | ConformityStatement | None) -> str:
    if isinstance(value, ConformityStatement):
        return f"{value.rule[:1].upper()}{value.rule[1:]}. Risk: {value.risk}. The verdicts stand in the table above."
    if isinstance(value, NotApplicable):
        return f"Not applicable: {value.statement}"
    return _day(value) if isinstance(value, date) else value or ""


@dataclass(frozen=True)
class PrintedConformity:
    """The verdicts as printed: (symbol, tolerance, unit, probability, verdict) and the joint probability."""

    rows: tuple[tuple[str, str, str, str, str], ...]
    joint: str
    count: int


def _conformity(value: object) -> PrintedConformity | None:
    if not isinstance(value, ConformityStatement):
        return None
    rows = tuple(
        (
            one.name,
            f"{PLUS_MINUS} {written(decimal_of(one.tolerance))}",
            one.unit,
            _probability(one.probability),
            one.verdict,
        )
        for one in value.verdicts
    )
    return PrintedConformity(rows, _probability(value.joint_probability), len(rows))


def _probability(p: float) -> str:
    """A probability of conformity in percent; what is nearly sure is not printed as sure."""
    if p < 0.001:
        return "< 0.1\N{NO-BREAK SPACE}%"
    if p > 0.999:
        return "> 99.9\N{NO-BREAK SPACE}%"
    return f"{written(round_to_place(100.0 * p, Decimal('0.1')))}\N{NO-BREAK SPACE}%"


def _day(day: date) -> str:
    return day.isoformat()


def _method(method: MethodUsed) -> list[tuple[str, str]]:
    return [
        ("Method", method.name or ""),
        ("Procedure", method.document or ""),
        ("Model", method.model or ""),
        ("Software", method.software or ""),
    ]


def _printed(result: ResultSet) -> PrintedResult:
    evaluation = result.evaluation
    if result.trials is not None:
        evaluation += f", {result.trials} trials"
    if result.validation is not None:
        evaluation += f"; {result.validation}"
    return PrintedResult(
        state=result.state,
        rows=tuple(_rows(result)),
        refused=tuple((", ".join(refusal.parameters), refusal.why) for refusal in result.refused),
        count=len(result.names),
        rank=result.rank,
        p=written_probability(result.p),
        k_q=written_factor(result.k_q),
        k_p=written_factor(result.k_p),
        evaluation=evaluation,
        half_axes="; ".join(written_factor(axis) for axis in result.half_axes),
        blocks=_blocks(result.names, result.correlation),
        pictures=pictures_of(result),
    )


def _rows(result: ResultSet) -> list[Row]:
    columns: tuple[list[str], list[str], list[str]] = ([], [], [])
    for value, u, expanded in zip(result.estimate, result.u, result.expanded, strict=True):
        rounded = round_result(float(value), float(expanded))
        columns[0].append(written(rounded.estimate))
        columns[1].append(written(round_uncertainty(float(u))))
        columns[2].append(written(rounded.uncertainty))
    estimates, standard, expansions = (_aligned(texts) for texts in columns)
    return [
        Row(name, words, (estimate, u, expanded), unit)
        for name, words, estimate, u, expanded, unit in zip(
            result.names, result.descriptions, estimates, standard, expansions, result.units, strict=True
        )
    ]


def _aligned(texts: list[str]) -> list[Number]:
    """Numbers with the room that each needs behind it for all decimal signs to stand below each other."""
    decimals = [len(text.partition(".")[2]) for text in texts]
    most = max(decimals, default=0)
    return [
        Number(text, round((most - count) * _DIGIT_EM + (_POINT_EM if most and not count else 0.0), 3))
        for text, count in zip(texts, decimals, strict=True)
    ]


def _blocks(names: tuple[str, ...], correlation: Array) -> tuple[Block, ...]:
    """The lower triangle in blocks of columns; rows wholly above the diagonal are left out.

    Names too long for a column are numbered instead.
    """
    long = max(map(len, names), default=0) > _LONGEST_COLUMN_NAME
    heads = tuple(str(place + 1) for place in range(len(names))) if long else names
    sides = tuple(f"{name} ({place + 1})" for place, name in enumerate(names)) if long else names
    blocks = []
    for start in range(0, len(names), CORRELATION_COLUMNS):
        columns = range(start, min(start + CORRELATION_COLUMNS, len(names)))
        rows = tuple(
            (sides[row], tuple(_cell(correlation[row, column]) for column in columns if column <= row))
            for row in range(start, len(names))
        )
        blocks.append(Block(tuple(heads[column] for column in columns), rows, long))
    return tuple(blocks)


def _cell(coefficient: float) -> Cell:
    return Cell(
        written_correlation(float(coefficient)), round(_DARKEST * min(abs(float(coefficient)), 1.0), 3)
    )
