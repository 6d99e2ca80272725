"""All machines at once: every parameter of every machine, what needs attention first.

Means, pooled variances, Bartlett, ANOVA and drift are computed from sums that the database makes; nothing is stored.
Of each machine the runs since its last recorded event count (`monitor event`).
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Container
from datetime import datetime

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import add_model, common
from monitor.cli.screen import on_screen
from monitor.reporting.messages import (
    UNEXPLAINED,
    attention_words,
    campaigns_of_same_hours,
    machines_contradicting,
    machines_lacking,
    machines_refuted,
    machines_simulated,
    numbers_of_older_version,
    times_stated,
)
from monitor.workflow.fleet.answer import FleetAnswer, FleetTableRow
from monitor.workflow.fleet.attention import ATTENTION, Attention
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest

EXAMPLE = "monitor fleet --top 50"

#: Campaigns that are named where they lack numbers.
MOST_NAMED = 10
#: What is said of a machine whose campaigns cannot all be its own.
SAME_HOURS = "campaigns overlap"
#: What a machine is called of which nothing was identified.
NOT_JUDGED = "not judged: not identified"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "--top", type=int, default=20, metavar="N", help="rows of the table (default 20; 0: all)"
    )
    add_model(parser)
    parser.add_argument(
        "--weekly-looks",
        action="store_true",
        help="also what looks at all machines every week noticed (reads the history of every machine)",
    )


def run(options: Namespace) -> int:
    request = FleetRequest(options.model, options.top, options.weekly_looks)
    with opened(options, judging=True) as db, output.working("summing"):
        answer = ask(db, fleet, request)
    if options.json:
        output.document(answer)
        return 0
    answer = on_screen(answer)
    _table(answer, options.top)
    output.say(_as_of(answer))
    for attention, count in answer.attention.items():
        if count:
            output.say(f"{count} of {answer.rows}: {attention}")
    widest = max((row.slope_widening for row in answer.table if row.slope_widening), default=1.0)
    if widest > 1.0:
        output.say(
            "slopes allow for days that resemble each other: their intervals are up to "
            f"{widest:.2g} times as wide as with independent days"
        )
    _say_of_machines(answer)
    if answer.weekly_looks is not None:
        from monitor.cli.trend_output import weekly_lines

        for line in weekly_lines(answer.weekly_looks, machines=True):
            output.say(line)
    if answer.not_identified:
        names = ", ".join(answer.not_identified[:MOST_NAMED]) + ", ..." * (
            len(answer.not_identified) > MOST_NAMED
        )
        output.say(
            f"not identified by the model that the numbers of their machine come from, and left out: {names}; "
            f"type `monitor identify {answer.not_identified[0]}`"
        )
    return 0


def _as_of(answer: FleetAnswer) -> str:
    """The day on which the table was computed, on which what is ahead depends, and those of the shown values."""
    days = sorted(row.latest_at[:10] for row in answer.table if row.latest_at is not None)
    computed = f"computed on {datetime.now().astimezone():%Y-%m-%d}"
    if not days:
        return computed
    latest = days[0] if days[0] == days[-1] else f"{days[0]} to {days[-1]}"
    return f"{computed}; the latest values shown are of {latest}"


def _table(answer: FleetAnswer, most: int) -> None:
    """Print the rows, and before them the machines without numbers, of these too no more than ``most`` (0: all)."""
    without = answer.without_numbers or ()
    named = without[: most or None]
    count = answer.machines + len(without)
    lacking = f", {len(without)} of them without numbers" if without else ""
    output.table(
        f"{count} machine{'' if count == 1 else 's'}{lacking}, {answer.values} values; "
        "q: false discovery rate over all rows",
        ["rank", "machine", "parameter", "attention", "relative to", "unit", "latest", "mean", "s runs", "s days",
         "a year", "limit", "Bartlett q", "ANOVA q", "drift q"],
        [
            *(["-", name, "-", NOT_JUDGED, *["-"] * 11] for name in named),
            *_rows(answer, most),
        ],
        text_columns=6,
    )  # fmt: skip
    if len(named) < len(without):
        output.say(f"{len(without) - len(named)} more without numbers; --top 0 names all")


def _rows(answer: FleetAnswer, most: int) -> list[list[str]]:
    """The rows of parameters, with those of ``most`` machines (0: all) whose numbers ask for nothing by a model that
    does not explain their latest readings: behind what asks for something, before what is as usual, as on the first
    page."""
    rows = [_cells(row, answer.same_hours or ()) for row in answer.table]
    usual = ATTENTION.index(Attention.AS_USUAL)
    asking = [row.machine for row in answer.table if ATTENTION.index(row.attention) < usual]
    if len(asking) == len(answer.table) < answer.rows:
        # What else asks for something is not shown.
        return rows
    contradicted = answer.statements_contradicted or {}
    unexplained = [
        ["-", machine, "-", UNEXPLAINED, *["-"] * 11]
        if machine not in contradicted
        else ["-", machine, "-", f"{UNEXPLAINED}: {times_stated(contradicted[machine].times)}", *["-"] * 11]
        for machine in answer.unexplained
        if machine not in asking
    ]
    return rows[: len(asking)] + unexplained[: most or None] + rows[len(asking) :]


def _say_of_machines(answer: FleetAnswer) -> None:
    """Say of whole machines which version their numbers are of, where their limits come from, and whose readings refute
    their model."""
    older = answer.older_versions or {}
    for machine, versions in list(older.items())[:MOST_NAMED]:
        for version in versions:
            output.say(numbers_of_older_version(machine, version.model, version.newest))
    if len(older) > MOST_NAMED:
        output.say(f"so are those of {len(older) - MOST_NAMED} more machines; --json names all")
    for machine, groups in list((answer.same_hours or {}).items())[:MOST_NAMED]:
        for campaigns in groups:
            output.say(campaigns_of_same_hours(machine, campaigns))
    _say_of_limits(answer)
    if answer.simulated:
        output.say(machines_simulated(answer.simulated, MOST_NAMED))
    if answer.models_refuted:
        latest = {machine: refuted.campaign for machine, refuted in answer.models_refuted.items()}
        output.say(machines_refuted(latest, MOST_NAMED))
    if answer.statements_contradicted:
        last = {
            machine: (each.campaign, each.times) for machine, each in answer.statements_contradicted.items()
        }
        output.say(machines_contradicting(last, MOST_NAMED))
    if answer.models_lacking:
        output.say(machines_lacking(answer.models_lacking, MOST_NAMED))


def _say_of_limits(answer: FleetAnswer) -> None:
    """Say of which machine type the limits of machines are, and which of them hold for none of their parameters."""
    for machine, name in (answer.tolerances_of_type or {}).items():
        output.say(f"limits of {machine} are those of the machine type '{name}' in the configuration")
    for machine, sentences in list((answer.limits_without_parameter or {}).items())[:MOST_NAMED]:
        for sentence in sentences:
            output.say(f"{machine}: {sentence}")


def _cells(row: FleetTableRow, same_hours: Container[str]) -> list[str]:
    attention = attention_words(row.attention, row.season_not_told)
    if row.attention is Attention.MAY_BE_OUT and row.probability_out is not None:
        attention += f", P(out) {100.0 * row.probability_out:.2g} %"
    if row.attention is Attention.DUE and row.in_tolerance_at_next_check is not None:
        attention += f", P(in) {100.0 * row.in_tolerance_at_next_check:.2g} %"
    return [
        str(row.rank), row.machine, row.parameter,
        f"{attention}; {SAME_HOURS}" if row.machine in same_hours else attention,
        row.refers_to or "", row.unit,
        _three(row.latest), _three(row.mean),
        "-" if row.sd_pooled is None else output.two_digits(row.sd_pooled),
        "-" if row.between_days is None else output.two_digits(row.between_days),
        _three(row.slope_per_year), "-" if row.limit is None else f"{row.limit:g}",
        output.probability(row.bartlett_q), output.probability(row.anova_q), output.probability(row.drift_q),
    ]  # fmt: skip


def _three(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"
