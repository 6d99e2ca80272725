"""Drift, changes, dependence on conditions, warm-up, alarms and forecast of a machine's parameters over its history.

A change that was found or recorded (`monitor event`) splits the history: the drift is that since the last one. Runs
marked warm_up are left out of drift and changes where six others remain. The control charts compare with a
reference period (--reference), by default the first third of the history.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from datetime import datetime
from pathlib import Path

from monitor.cli import output, trend_output
from monitor.cli.database import ask, opened
from monitor.cli.moments import moment
from monitor.cli.parser import add_model, common
from monitor.cli.screen import on_screen
from monitor.exceptions import InputError
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend

EXAMPLE = "monitor trend HU40-T --since 2025-01-01 --figures figures"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("machine", metavar="MACHINE", help="a machine of the database, by its id")
    parser.add_argument("--parameter", metavar="P", help="one parameter only")
    parser.add_argument("--since", metavar="DATE", help="only runs from then on")
    parser.add_argument("--until", metavar="DATE", help="only runs before then")
    parser.add_argument("--method", metavar="NAME", help="only runs of this calibration method")
    warmth = parser.add_mutually_exclusive_group()
    warmth.add_argument(
        "--warm", action="store_const", dest="warm_up", const=False, help="only runs of a warm machine"
    )
    warmth.add_argument(
        "--warming-up",
        action="store_const",
        dest="warm_up",
        const=True,
        help="only runs of a machine that warms up",
    )
    parser.add_argument("--next-check", metavar="DATE", help="when the machine is to be checked again")
    parser.add_argument(
        "--reliability", type=float, default=0.95, metavar="P",
        help="wanted probability of being in tolerance until the next check (default 0.95)",
    )  # fmt: skip
    parser.add_argument(
        "--volumetric-limit", type=float, metavar="UM",
        help="limit of the volumetric error, in place of 'volumetric' of the machine's tolerances, in µm",
    )  # fmt: skip
    parser.add_argument(
        "--reference", metavar="FROM..TO", help="reference period of the control charts, two dates"
    )
    parser.add_argument(
        "--campaign", action="append", default=[], metavar="NAME", help="only this campaign (may be repeated)"
    )
    add_model(parser)
    parser.add_argument(
        "--weekly-looks",
        action="store_true",
        help="also what looks at the whole fleet every week noticed (reads the history of every machine)",
    )
    parser.add_argument("--figures", type=Path, metavar="DIR", help="draw every parameter over the dates")


def _period(text: str) -> tuple[datetime, datetime]:
    start, dots, end = text.partition("..")
    if not dots:
        raise InputError(f"--reference {text}: write two dates as 2026-01-01..2026-03-01")
    return moment(start, "--reference"), moment(end, "--reference")


def run(options: Namespace) -> int:
    request = TrendRequest(
        machine=options.machine,
        parameter=options.parameter,
        since=None if options.since is None else moment(options.since, "--since"),
        next_check=None if options.next_check is None else moment(options.next_check, "--next-check"),
        reference=None if options.reference is None else _period(options.reference),
        reliability=options.reliability,
        campaigns=tuple(options.campaign),
        model=options.model,
        volumetric_limit_um=options.volumetric_limit,
        figures=options.figures,
        weekly_looks=options.weekly_looks,
        until=None if options.until is None else moment(options.until, "--until"),
        method=options.method,
        warm_up=options.warm_up,
    )
    with opened(options, judging=True) as db, output.working("following"):
        answer = ask(db, trend, request)
    if options.json:
        output.document(answer)
    else:
        trend_output.say(on_screen(answer))
    return 0
