"""Drift, changes, dependence on conditions, warm-up, alarms and forecast of a machine's parameters over its history.

A change that was found or recorded (`monitor event`) splits the history: the drift is that since the last one. Runs
marked warm_up are left out of drift and changes where six others remain. The control charts compare with a
reference period (--reference), by default the first third of the history.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from datetime import UTC, datetime
from pathlib import Path

from monitor.cli import output, trend_output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.exceptions import InputError
from monitor.workflow.trend.trends import Choice, trends

EXAMPLE = "monitor trend HU40-T --since 2025-01-01 --figures figures"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("machine", metavar="MACHINE")
    parser.add_argument("--parameter", metavar="P", help="one parameter only")
    parser.add_argument("--since", metavar="DATE", help="only runs from then on")
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
    parser.add_argument("--model", metavar="NAME")
    parser.add_argument("--figures", type=Path, metavar="DIR", help="draw every parameter over the dates")


def _date(text: str, option: str) -> datetime:
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise InputError(
            f"{option} {text}: write a date as 2026-03-05 or 2026-03-05T07:00:00-05:00"
        ) from None
    return moment if moment.tzinfo is not None else moment.replace(tzinfo=UTC)


def run(options: Namespace) -> int:
    if not 0.0 < options.reliability < 1.0:
        raise InputError(f"--reliability {options.reliability:g}: a probability lies between 0 and 1")
    limit = options.volumetric_limit
    if limit is not None and not 0.0 < limit < float("inf"):
        raise InputError(f"--volumetric-limit {limit:g}: a limit in µm lies above zero")
    if limit is not None and options.parameter is not None:
        raise InputError("--volumetric-limit needs all parameters; leave out --parameter")
    reference = None
    if options.reference is not None:
        start, dots, end = options.reference.partition("..")
        if not dots:
            raise InputError(f"--reference {options.reference}: write two dates as 2026-01-01..2026-03-01")
        reference = (_date(start, "--reference"), _date(end, "--reference"))
        if reference[0] >= reference[1]:
            raise InputError(f"--reference {options.reference}: the first date must lie before the second")
    choice = Choice(
        parameter=options.parameter,
        since=None if options.since is None else _date(options.since, "--since"),
        next_check=None if options.next_check is None else _date(options.next_check, "--next-check"),
        reference=reference,
        reliability=options.reliability,
        campaigns=tuple(options.campaign),
        model=options.model,
        volumetric_limit_um=limit,
    )
    with opened(options) as db, output.working("following"), db.transaction():
        made = trends(db, options.machine, choice)
        found = made.document
        if options.figures is not None:
            from monitor.workflow.trend.figures import trend_figures

            found["figures"] = trend_figures(made, options.figures)
    if options.json:
        output.document(found)
        return 0
    trend_output.say(found)
    return 0
