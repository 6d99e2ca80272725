"""What ISO 230-2, -4, -6, -7 and ISO 10791-6, -7 report of the tests of a campaign, with uncertainties."""

from __future__ import annotations

import math
from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import common
from monitor.cli.screen import on_screen
from monitor.workflow.standards.answer import StandardTest
from monitor.workflow.standards.request import StandardsRequest
from monitor.workflow.standards.standards import standards

EXAMPLE = "monitor standards laser --figures figures"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "campaign", metavar="CAMPAIGN", help="a campaign of the database (monitor campaigns lists them)"
    )
    parser.add_argument("--setup", metavar="ID", help="this setup alone (default: all)")
    parser.add_argument("--figures", type=Path, metavar="DIR", help="draw the plot of every test")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="write one line a figure")
    parser.add_argument(
        "--seed", type=int, default=1, metavar="S", help="seed of the uncertainties' draws (default 1)"
    )


def run(options: Namespace) -> int:
    request = StandardsRequest(options.campaign, options.setup, options.figures, options.csv, options.seed)
    with opened(options) as db, output.working("evaluating"):
        answer = ask(db, standards, request)
    if options.json:
        output.document(answer)
        return 0
    output.copied(answer.copied_readings)
    for test in on_screen(answer).tests:
        _say(test)
    if answer.left_out:
        output.say(f"no test of these standards: {', '.join(answer.left_out)}; identify reads them all")
    for file in answer.files:
        output.say(file)
    return 0


def _say(test: StandardTest) -> None:
    standard = test.figures[0].standard.split(",")[0]
    output.say(f"{test.setup}, run {test.run}: {test.test} of {test.of}, {standard}")
    rows = [
        [
            figure.symbol,
            figure.name,
            output.rounded(figure.value, figure.u) + (f" {figure.unit}" if figure.unit != test.unit else ""),
            output.two_digits(figure.u),
        ]
        for figure in test.figures
        if not math.isnan(figure.value)
    ]
    output.table("", ["symbol", "figure", test.unit, "u"], rows)
    for note in test.notes:
        output.say(str(note))
