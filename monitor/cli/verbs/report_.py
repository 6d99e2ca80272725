"""The weekly health report: a fleet table by urgency, then a page a machine, as HTML and PDF.

What the campaigns of the week still lack (identification, uncertainty, explanation) is computed and stored.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.exceptions import InputError
from monitor.workflow.health.machine import Settings
from monitor.workflow.health.mail import mail_report, read_mail_settings
from monitor.workflow.health.report import report

EXAMPLE = "monitor report --week 2026-W10 --out reports-out --fail-on-alarm"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("--week", metavar="YYYY-Www", help="default: the last week that has ended")
    parser.add_argument("--machine", metavar="ID", help="one machine alone")
    parser.add_argument(
        "--out", type=Path, default=Path(), metavar="DIR", help="default: the working directory"
    )
    parser.add_argument("--model", metavar="NAME", help="default: the method's own")
    parser.add_argument(
        "--campaign", action="append", default=[], metavar="NAME", help="only this campaign (may be repeated)"
    )
    parser.add_argument(
        "--risk", type=float, default=0.05, metavar="P",
        help="probability of being out of tolerance above which a machine alarms (default 0.05)",
    )  # fmt: skip
    parser.add_argument(
        "--workers", type=int, metavar="N",
        help="processes that compute; the report is the same for any number (default: the cores, at most 4, fewer "
        "for few machines)",
    )  # fmt: skip
    parser.add_argument(
        "--fail-on-alarm",
        action="store_true",
        help="exit status 1 where a machine is, or may be, out of tolerance",
    )
    parser.add_argument(
        "--mail",
        type=Path,
        metavar="FILE",
        help="send it as this configuration says (see examples/mail.toml)",
    )


def run(options: Namespace) -> int:
    if options.mail is not None:
        read_mail_settings(options.mail)  # what is wrong with it is said before the work, not after
    settings = Settings(options.model, tuple(options.campaign), options.risk)
    with opened(options, threads=1) as db, output.working("reporting"):
        found = report(
            db, options.week, options.machine, options.out, settings=settings, workers=options.workers
        )
    found["mailed_to"], unsent = [], None
    try:
        found["mailed_to"] = [] if options.mail is None else mail_report(options.mail, found)
    except InputError as error:
        unsent = error  # the report is there all the same, and is told before what went wrong
    if options.json:
        output.document(found)
    else:
        output.table(
            f"week {found['week']}, {found['from']} to {found['to']}",
            ["machine", "state", "what changed", "since", "P(out)", "next check"],
            [
                [
                    one["machine"],
                    one["state"],
                    one["changed"],
                    (one["since"] or "-")[:10],
                    "-" if one["probability_out"] is None else f"{one['probability_out']:.2g}",
                    one["next_check"],
                ]
                for one in found["machines"]
            ],
            text_columns=6,
        )
        if found["message"]:
            output.say(found["message"])
        for file in found["files"]:
            output.say(file)
        for address in found["mailed_to"]:
            output.say(f"sent to {address}")
    if unsent is not None:
        raise InputError(f"the report was written, but not sent: {unsent}") from unsent
    return 1 if options.fail_on_alarm and found["alarms"] else 0
