"""The tables of a certificate: rounded numbers in its language, their decimal signs below each other."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import NamedTuple

from monitor.records import VOLUMETRIC
from monitor.reporting.certificate.record import ConformityStatement, ConformityVerdict
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.certificate.words import verdict_words
from monitor.reporting.numbers import (
    LESS_OR_EQUAL,
    PLUS_MINUS,
    decimal_of,
    round_result,
    round_to_place,
    round_uncertainty,
)
from monitor.reporting.palette import PAGE_WIDTH_MM
from monitor.reporting.svg.letter_widths import BOLD, MILLIMETRES_A_POINT, in_mm
from monitor.reporting.texts import Texts

#: Letters of the tables, and what a column of the results needs besides its letters.
LETTERS_PT, _PADDING_MM = 8.0, 3.2
#: Longer symbols are broken.
_MOST_NAME_MM = 48.0
#: Width of a digit and of the decimal signs in DejaVu Sans, in em (1303 and 651 of 2048 units).
_DIGIT_EM, _POINT_EM = 1303 / 2048, 651 / 2048


@dataclass(frozen=True)
class Number:
    """A number as printed, and the room behind it (in em) that puts its decimal sign below the others'."""

    text: str
    room: float


class Row(NamedTuple):
    """One parameter as printed: estimate, standard and expanded uncertainty."""

    name: str
    description: str
    numbers: tuple[Number, Number, Number]
    unit: str


@dataclass(frozen=True)
class PrintedConformity:
    """The verdicts as printed: (symbol, tolerance, unit, probability, verdict).

    ``joint`` is the joint probability of the ``count`` parameters among them.
    ``bands`` are the guard bands and ``risks`` the global risks (R_C, R_P) of the rows; empty where none are stored.
    """

    rows: tuple[tuple[str, str, str, str, str], ...]
    joint: str
    count: int
    bands: tuple[str, ...] = ()
    risks: tuple[tuple[str, str], ...] = ()


def result_rows(result: ResultSet, texts: Texts) -> tuple[Row, ...]:
    """One row a parameter, estimates at the place of the rounded expanded uncertainty."""
    columns: tuple[list[str], list[str], list[str]] = ([], [], [])
    for value, u, expanded in zip(result.estimate, result.u, result.expanded, strict=True):
        rounded = round_result(float(value), float(expanded))
        columns[0].append(texts.number(rounded.estimate))
        columns[1].append(texts.number(round_uncertainty(float(u))))
        columns[2].append(texts.number(rounded.uncertainty))
    estimates, standard, expansions = (aligned(column, texts.decimal_sign) for column in columns)
    return tuple(
        Row(name, description, (estimate, u, expanded), unit)
        for name, description, estimate, u, expanded, unit in zip(
            result.names, result.descriptions, estimates, standard, expansions, result.units, strict=True
        )
    )


def result_widths(rows: tuple[Row, ...], heads: tuple[str, str, str, str, str, str]) -> tuple[float, ...]:
    """The widths in mm of the six columns of the results; the second, which is broken into lines, takes the rest.

    Known before the page is laid out, which then need not try every cell: a third of the time of 149 parameters.
    """
    bold = [BOLD * in_mm(head, LETTERS_PT) + _PADDING_MM for head in heads]
    names = max((BOLD * in_mm(row.name, LETTERS_PT) for row in rows), default=0.0) + _PADDING_MM
    numbers = [
        max(
            (
                in_mm(row.numbers[index].text, LETTERS_PT)
                + row.numbers[index].room * LETTERS_PT * MILLIMETRES_A_POINT
                for row in rows
            ),
            default=0.0,
        )
        + _PADDING_MM
        for index in range(3)
    ]
    units = max((in_mm(row.unit, LETTERS_PT) for row in rows), default=0.0) + _PADDING_MM
    wide = [max(pair) for pair in zip([*numbers, units], bold[2:], strict=True)]
    symbol = min(max(names, bold[0]), _MOST_NAME_MM)
    return symbol, PAGE_WIDTH_MM - symbol - sum(wide), *wide


def aligned(written: list[str], decimal_sign: str) -> list[Number]:
    """Numbers with the room that each needs behind it for all decimal signs to stand below each other."""
    decimals = [len(text.partition(decimal_sign)[2]) for text in written]
    most = max(decimals, default=0)
    return [
        Number(text, round((most - count) * _DIGIT_EM + (_POINT_EM if most and not count else 0.0), 3))
        for text, count in zip(written, decimals, strict=True)
    ]


def conformity_rows(statement: ConformityStatement, texts: Texts) -> PrintedConformity:
    """The verdicts with their tolerances and probabilities."""
    rows = tuple(
        (
            judged_name(verdict, texts),
            tolerance_words(verdict, texts),
            verdict.unit,
            _probability(verdict.probability, texts),
            verdict_words(verdict.verdict, texts),
        )
        for verdict in statement.verdicts
    )
    verdicts = statement.verdicts
    return PrintedConformity(
        rows,
        "" if statement.joint_probability is None else _probability(statement.joint_probability, texts),
        sum(verdict.name != VOLUMETRIC for verdict in statement.verdicts),
        bands=tuple(guard_band(verdict, texts) for verdict in verdicts)
        if any(verdict.guard_band is not None for verdict in verdicts)
        else (),
        risks=tuple(
            (_risk(verdict.consumers_risk, texts), _risk(verdict.producers_risk, texts))
            for verdict in verdicts
        )
        if any(verdict.consumers_risk is not None for verdict in verdicts)
        else (),
    )


def judged_name(verdict: ConformityVerdict, texts: Texts) -> str:
    """What a verdict is of: the symbol of its parameter, or the volumetric error."""
    return texts("page.volumetric_error") if verdict.name == VOLUMETRIC else verdict.name


def tolerance_words(verdict: ConformityVerdict, texts: Texts) -> str:
    """The tolerance without its unit: of either sign, or what a length does not exceed."""
    limit = texts.number(decimal_of(verdict.tolerance))
    return f"{LESS_OR_EQUAL if verdict.name == VOLUMETRIC else PLUS_MINUS} {limit}"


def guard_band(verdict: ConformityVerdict, texts: Texts) -> str:
    """The guard band of a verdict in the unit of its parameter, as an uncertainty is written."""
    if not verdict.guard_band:
        return "0"
    return texts.number(round_uncertainty(verdict.guard_band))


def _risk(risk: float | None, texts: Texts) -> str:
    """A global risk in percent, two digits behind the decimal sign; a dash where no spread is stated."""
    if risk is None:
        return "\N{EN DASH}"
    hundredth = Decimal("0.01")
    if risk < 1e-4:
        return f"< {texts.number(hundredth)}\N{NO-BREAK SPACE}%"
    return f"{texts.number(round_to_place(100.0 * risk, hundredth))}\N{NO-BREAK SPACE}%"


def _probability(p: float, texts: Texts) -> str:
    """A probability of conformity in percent; what is nearly sure is not printed as sure."""
    tenth = Decimal("0.1")
    if p < 0.001:
        written = f"< {texts.number(tenth)}"
    elif p > 0.999:
        written = f"> {texts.number(100 - tenth)}"
    else:
        written = texts.number(round_to_place(100.0 * p, tenth))
    return f"{written}\N{NO-BREAK SPACE}%"
