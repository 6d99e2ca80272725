"""The tables of a certificate: rounded numbers in its language, their decimal signs below each other."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal

from monitor.records import Array
from monitor.reporting.certificate import ConformityStatement
from monitor.reporting.certificate_words import verdict_words
from monitor.reporting.numbers import (
    PLUS_MINUS,
    decimal_of,
    round_result,
    round_to_place,
    round_uncertainty,
    written_correlation,
)
from monitor.reporting.results import ResultSet
from monitor.reporting.texts import Texts

#: Columns of the correlation matrix that stand side by side; a wider matrix is broken into blocks.
CORRELATION_COLUMNS = 15
#: Longer names do not fit above a column of the matrix.
_LONGEST_COLUMN_NAME = 6
#: Width of a digit and of the decimal signs in DejaVu Sans, in em (1303 and 651 of 2048 units).
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
    """A correlation coefficient and the grey behind it (0 black to 255 white)."""

    text: str
    grey: int


@dataclass(frozen=True)
class Block:
    """A part of the correlation matrix: its column names and rows of (name, cells)."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, tuple[Cell, ...]], ...]
    numbered: bool


@dataclass(frozen=True)
class PrintedConformity:
    """The verdicts as printed: (symbol, tolerance, unit, probability, verdict) and the joint probability."""

    rows: tuple[tuple[str, str, str, str, str], ...]
    joint: str
    count: int


def result_rows(result: ResultSet, texts: Texts) -> tuple[Row, ...]:
    """One row a parameter, estimates at the place of the rounded expanded uncertainty."""
    columns: tuple[list[str], list[str], list[str]] = ([], [], [])
    for value, u, expanded in zip(result.estimate, result.u, result.expanded, strict=True):
        rounded = round_result(float(value), float(expanded))
        columns[0].append(texts.number(rounded.estimate))
        columns[1].append(texts.number(round_uncertainty(float(u))))
        columns[2].append(texts.number(rounded.uncertainty))
    estimates, standard, expansions = (aligned(one, texts.decimal_sign) for one in columns)
    return tuple(
        Row(name, words, (estimate, u, expanded), unit)
        for name, words, estimate, u, expanded, unit in zip(
            result.names, result.descriptions, estimates, standard, expansions, result.units, strict=True
        )
    )


def aligned(written: list[str], decimal_sign: str) -> list[Number]:
    """Numbers with the room that each needs behind it for all decimal signs to stand below each other."""
    decimals = [len(text.partition(decimal_sign)[2]) for text in written]
    most = max(decimals, default=0)
    return [
        Number(text, round((most - count) * _DIGIT_EM + (_POINT_EM if most and not count else 0.0), 3))
        for text, count in zip(written, decimals, strict=True)
    ]


def correlation_blocks(names: tuple[str, ...], correlation: Array, texts: Texts) -> tuple[Block, ...]:
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
            (sides[row], tuple(_cell(correlation[row, one], texts) for one in columns if one <= row))
            for row in range(start, len(names))
        )
        blocks.append(Block(tuple(heads[column] for column in columns), rows, long))
    return tuple(blocks)


def _cell(coefficient: float, texts: Texts) -> Cell:
    # An opaque grey: transparency is what PDF/A-1 readers stumble over, and paper does not need it.
    grey = round(255 * (1.0 - _DARKEST * min(abs(float(coefficient)), 1.0)))
    return Cell(written_correlation(float(coefficient), texts.decimal_sign), grey)


def conformity_rows(statement: ConformityStatement, texts: Texts) -> PrintedConformity:
    """The verdicts with their tolerances and probabilities."""
    rows = tuple(
        (
            one.name,
            f"{PLUS_MINUS} {texts.number(decimal_of(one.tolerance))}",
            one.unit,
            _probability(one.probability, texts),
            verdict_words(one.verdict, texts),
        )
        for one in statement.verdicts
    )
    return PrintedConformity(rows, _probability(statement.joint_probability, texts), len(rows))


def _probability(p: float, texts: Texts) -> str:
    """A probability of conformity in percent; what is nearly sure is not printed as sure."""
    tenth = Decimal("0.1")
    if p < 0.001:
        words = f"< {texts.number(tenth)}"
    elif p > 0.999:
        words = f"> {texts.number(100 - tenth)}"
    else:
        words = texts.number(round_to_place(100.0 * p, tenth))
    return f"{words}\N{NO-BREAK SPACE}%"
