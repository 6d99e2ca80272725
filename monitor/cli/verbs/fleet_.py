"""All machines at once: every parameter of every machine, what needs attention first.

Means, pooled variances, Bartlett, ANOVA and drift are computed from sums that the database makes; nothing is stored.
Of each machine the days since its last recorded event count (`monitor event`).
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.exceptions import InputError
from monitor.workflow.fleet import fleet

EXAMPLE = "monitor fleet --top 50"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "--top", type=int, default=20, metavar="N", help="rows of the table (default 20; 0: all)"
    )
    parser.add_argument("--model", metavar="NAME")


def run(options: Namespace) -> int:
    if options.top < 0:
        raise InputError(f"--top {options.top}: a number of rows, 0 for all")
    with opened(options) as db, output.working("summing"):
        found = fleet(db, options.model, options.top or None)
    if options.json:
        output.document(found)
        return 0
    machines = f"{found['machines']} machine{'' if found['machines'] == 1 else 's'}"
    rows = [
        [
            str(one["rank"]), one["machine"], one["parameter"], one["attention"], one["unit"],
            "-" if one["latest"] is None else f"{one['latest']:.3g}", f"{one['mean']:.3g}",
            "-" if one["sd_pooled"] is None else output.two_digits(one['sd_pooled']),
            "-" if one["between_days"] is None else output.two_digits(one['between_days']),
            "-" if one["slope_per_year"] is None else f"{one['slope_per_year']:.3g}",
            "-" if one["limit"] is None else f"{one['limit']:g}",
            *(output.probability(one[f"{test}_q"]) for test in ("bartlett", "anova", "drift")),
        ]
        for one in found["table"]
    ]  # fmt: skip
    output.table(
        f"{machines}, {found['values']} values; q: false discovery rate over all rows",
        ["rank", "machine", "parameter", "attention", "unit", "latest", "mean", "s runs", "s days", "a year", "limit",
         "Bartlett q", "ANOVA q", "drift q"],
        rows, text_columns=5,
    )  # fmt: skip
    for words, count in found["attention"].items():
        if count:
            output.say(f"{count} of {found['rows']}: {words}")
    return 0
