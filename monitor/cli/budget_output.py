"""What stands behind an uncertainty as tables and sentences: budget, components of the days, sources, length."""

from __future__ import annotations

from monitor.cli import output
from monitor.reporting.budget import HoldsFor, budget_lines, line_words
from monitor.reporting.budget_words import (
    days_sentences,
    length_sentence,
    negative_sentence,
    source_words,
    unchecked_sentence,
)
from monitor.reporting.texts import texts_of
from monitor.workflow.uncertainty.answer import UncertaintyAnswer

#: Lines of the budget that stand side by side.
_ABREAST = 9
#: Smaller parts of a micrometre, microradian or µm/m are written in nano- and pico-units.
SMALLEST_IN_MICRO = 1e-3


def behind(answer: UncertaintyAnswer) -> None:
    """Everything that stands behind the stated uncertainty."""
    texts = texts_of()
    _budget(answer)
    _days(answer)
    for sentence in days_sentences(
        answer.holds_for or HoldsFor.RUN, answer.day_to_day, answer.guf.expanded, answer.units, texts
    ):
        output.say(sentence)
    if answer.day_to_day is not None and answer.day_to_day.not_from_zero:
        output.say(negative_sentence(answer.day_to_day, texts))
    if answer.unchecked is not None:
        output.say(unchecked_sentence(answer.unchecked, texts))
    if answer.length is not None:
        output.say(length_sentence(answer.length, texts))


def _budget(answer: UncertaintyAnswer) -> None:
    texts, guf = texts_of(), answer.guf
    lines = budget_lines(guf.budget, guf.u, guf.budget_degrees_of_freedom or {})
    for first in range(0, len(lines), _ABREAST):
        part = lines[first : first + _ABREAST]
        heads = [f"({first + index})" for index in range(1, len(part) + 1)]
        rows = [
            [
                name,
                answer.units[name],
                *(_contribution(line.u[column], answer.units[name]) for line in part),
                output.two_digits(guf.u[name]),
            ]
            for column, name in enumerate(answer.parameters)
        ]
        title = "budget: what each line adds to u, as a standard uncertainty (u² is the sum of their squares)"
        output.table(title if not first else "", ["parameter", "unit", *heads, "u"], rows, text_columns=2)
    stated = {source.name: source for source in answer.sources or ()}
    for number, line in enumerate(lines, start=1):
        freedom = (
            "known"
            if line.degrees_of_freedom is None
            else f"{line.degrees_of_freedom:.4g} degrees of freedom"
        )
        source = stated.get(line.source)
        described = "" if source is None else f": {source_words(source, texts)}"
        output.say(f"({number}) {line_words(line.source, texts)}{described}; {freedom}")
    for source in stated.values():
        if not source.counted:
            output.say(
                f"not added: {source.name} ({source_words(source, texts)}); repeated runs scatter by it already"
            )


def _contribution(u: float, unit: str = "") -> str:
    """A part of u with two digits; below a thousandth of a micro-unit with the unit that it reads in."""
    if abs(u) < 1e-9:
        return "0"
    sign = "-" if u < 0.0 else ""
    if abs(u) >= SMALLEST_IN_MICRO or not unit.startswith("µ"):
        return f"{sign}{output.two_digits(abs(u))}"
    prefix, times = ("n", 1e3) if abs(u) >= 0.1 * SMALLEST_IN_MICRO else ("p", 1e6)
    return f"{sign}{output.two_digits(times * abs(u))} {prefix}{unit[1:]}"


def _days(answer: UncertaintyAnswer) -> None:
    days = answer.day_to_day
    if days is None or days.runs < 2:
        return

    def number(value: float, unit: str) -> str:
        return "-" if value != value else _contribution(value, unit)

    rows = [
        [
            name,
            answer.units[name],
            number(days.within_run[name], answer.units[name]),
            number(days.between_runs[name], answer.units[name]),
            number(days.u_day[name], answer.units[name]),
            " to ".join(number(end, answer.units[name]) for end in days.u_day_interval[name]),
            output.rounded(days.spread[name], answer.guf.expanded[name]),
            output.two_digits(answer.guf.expanded[name]),
        ]
        for name in answer.parameters
        if name in days.u_day
    ]
    columns = [
        "parameter",
        "unit",
        "within a run",
        "between runs",
        "u_day",
        "95 % of u_day",
        "span of days",
        "U",
    ]
    title = f"components of {days.runs} runs on {days.days} day{'s' if days.days != 1 else ''}, as standard deviations"
    output.table(title, columns, rows, text_columns=2)
