"""What stands behind the results as printed: sentences below the table, the budget, the components of the days."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from monitor.reporting.budget import Budget, BudgetLine, DayToDay, line_words
from monitor.reporting.budget_words import (
    days_sentences,
    length_sentence,
    negative_sentence,
    source_words,
    unchecked_sentence,
)
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.certificate.tables import Number, aligned
from monitor.reporting.numbers import decimal_of, round_result, round_to_place, round_uncertainty
from monitor.reporting.texts import Texts

#: Lines of the budget that stand side by side on a page.
_ABREAST = 10
#: A contribution below this part of u is written as 0, as the page says: it is 5e-9 of u in a sum of squares.
_NOTHING = 1e-4
_UNKNOWN = "\N{EN DASH}"


@dataclass(frozen=True)
class PrintedTable:
    """A table of numbers by parameter: heads, then (symbol, unit, numbers) a row."""

    heads: tuple[Markup, ...]
    rows: tuple[tuple[str, str, tuple[Number, ...]], ...]


@dataclass(frozen=True)
class PrintedBehind:
    """Sentences below the results; the budget in blocks, with its lines in words and what was not added, to
    what gains refer; the days."""

    sentences: tuple[str, ...]
    budget: tuple[PrintedTable, ...]
    lines: tuple[Markup, ...]
    length: str
    days: PrintedTable | None
    days_explained: Markup


def printed_behind(result: ResultSet, texts: Texts) -> PrintedBehind | None:
    """What stands behind a result; None for one that was issued before this was known."""
    budget = result.budget
    if budget is None:
        return None
    expanded = _expanded(result)
    days = budget.day_to_day
    shown = days if days is not None and days.runs > 1 else None
    blocks = -(-len(budget.lines) // _ABREAST)
    abreast = -(-len(budget.lines) // max(blocks, 1))
    return PrintedBehind(
        behind_sentences(result, budget, texts),
        tuple(
            _block(result, budget.lines[first : first + abreast], first, texts)
            for first in range(0, len(budget.lines), max(abreast, 1))
        ),
        _lines(budget, texts),
        "" if budget.length is None else length_sentence(budget.length, texts),
        None if shown is None else _days(result, shown, expanded, texts),
        Markup("") if shown is None else _days_explained(shown, texts),
    )


def behind_sentences(result: ResultSet, budget: Budget, texts: Texts) -> tuple[str, ...]:
    """For which time the uncertainty holds, which day means span more than U, and which readings nothing checks."""
    units = dict(zip(result.names, result.units, strict=True))
    sentences = days_sentences(budget.holds_for, budget.day_to_day, _expanded(result), units, texts)
    if budget.unchecked is not None:
        sentences += (unchecked_sentence(budget.unchecked, texts),)
    return sentences


def _expanded(result: ResultSet) -> dict[str, float]:
    return dict(zip(result.names, map(float, result.expanded), strict=True))


def _days_explained(days: DayToDay, texts: Texts) -> Markup:
    explained = texts.markup("budget.days_explained", runs=days.runs, days=days.days)
    return explained + Markup(" {}").format(negative_sentence(days, texts))


def _written(value: float, texts: Texts, nothing: float = 0.0) -> str:
    if value != value:
        return _UNKNOWN
    if abs(value) <= nothing:
        return "0"
    rounded = round_uncertainty(abs(value))
    return texts.number(-rounded if value < 0.0 else rounded)


def _columns(
    result: ResultSet,
    names: Sequence[str],
    columns: Sequence[list[str]],
    heads: tuple[Markup, ...],
    texts: Texts,
) -> PrintedTable:
    numbers = [aligned(column, texts.decimal_sign) for column in columns]
    units = dict(zip(result.names, result.units, strict=True))
    rows = tuple(
        (name, units[name], tuple(column[position] for column in numbers))
        for position, name in enumerate(names)
    )
    return PrintedTable(heads, rows)


def _block(result: ResultSet, lines: tuple[BudgetLine, ...], first: int, texts: Texts) -> PrintedTable:
    heads = tuple(Markup("({})").format(first + number) for number in range(1, len(lines) + 1))
    columns = [
        [
            _written(float(value), texts, _NOTHING * float(u))
            for value, u in zip(line.u, result.u, strict=True)
        ]
        for line in lines
    ]
    total = [_written(float(u), texts) for u in result.u]
    return _columns(result, result.names, [*columns, total], (*heads, Markup("u")), texts)


def _lines(budget: Budget, texts: Texts) -> tuple[Markup, ...]:
    """Every line in words, then what was stated and not added."""
    stated = {source.name: source for source in budget.sources}
    printed = []
    for number, line in enumerate(budget.lines, start=1):
        phrases = [line_words(line.source, texts)]
        if line.source in stated:
            phrases.append(source_words(stated[line.source], texts))
        if line.degrees_of_freedom is None:
            phrases.append(texts("budget.known"))
        else:
            dof = texts.number(round_to_place(line.degrees_of_freedom, decimal_of(0.1)).normalize())
            phrases.append(texts("budget.freedom", dof=dof))
        printed.append(Markup("<strong>({})</strong> {}").format(number, "; ".join(phrases)))
    printed += [
        texts.markup("budget.not_added", name=source.name, words=source_words(source, texts))
        for source in budget.sources
        if not source.counted
    ]
    return tuple(printed)


def _days(result: ResultSet, days: DayToDay, expanded: dict[str, float], texts: Texts) -> PrintedTable:
    heads = tuple(
        texts.markup(f"budget.{key}") for key in ("within_run", "between_runs", "u_day", "interval", "spread")
    )
    # An effect of the model that a run alone says nothing of has no components.
    names = [name for name in result.names if name in days.u_day]
    interval = [
        f"{_written(low, texts)} \N{HORIZONTAL ELLIPSIS} {_written(high, texts)}" if low == low else _UNKNOWN
        for low, high in (days.u_day_interval[name] for name in names)
    ]
    columns = [
        [_written(values[name], texts) for name in names]
        for values in (days.within_run, days.between_runs, days.u_day)
    ]
    spread = [texts.number(round_result(days.spread[name], expanded[name]).estimate) for name in names]
    table = _columns(result, names, [*columns, interval, spread], (*heads, Markup("U")), texts)
    larger = [_written(expanded[name], texts) for name in names]
    last = aligned(larger, texts.decimal_sign)
    plain = [Number(text, 0.0) for text in interval]
    rows = tuple(
        (name, unit, (*numbers[:3], plain[row], numbers[4], last[row]))
        for row, (name, unit, numbers) in enumerate(table.rows)
    )
    return PrintedTable(table.heads, rows)
