"""The weekly health report: a fleet table by urgency, then a page a machine, as HTML and PDF.

What the campaigns of the week still lack (identification, uncertainty, explanation) is computed and stored.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import replace
from pathlib import Path

from monitor.cli import output
from monitor.cli.configuration import configuration
from monitor.cli.database import ask, opened
from monitor.cli.parser import common
from monitor.cli.secret_files import warn_of_readers
from monitor.exceptions import InputError
from monitor.reporting.health.records import state_in_words
from monitor.workflow.health.mail import mail_report, read_mail_settings
from monitor.workflow.health.request import ReportAnswer, ReportOptions, ReportRequest
from monitor.workflow.query import machines

#: What stands for --mail without a file.
_CONFIGURED = Path()
EXAMPLE = "monitor report --week 2026-W10 --out reports-out --fail-on-alarm"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("--week", metavar="YYYY-Www", help="default: the last week that has ended")
    parser.add_argument("--machine", metavar="ID", help="one machine alone")
    parser.add_argument(
        "--out", type=Path, default=Path(), metavar="DIR", help="default: the working directory"
    )
    parser.add_argument(
        "--model", metavar="NAME", help="default: that of each machine, else its method's own"
    )
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
        "--cluster", metavar="ADDRESS", help="compute on a Dask cluster, such as tcp://host:8786"
    )
    parser.add_argument(
        "--fail-on-alarm",
        action="store_true",
        help="exit status 1 where a machine is, or may be, out of tolerance",
    )
    parser.add_argument(
        "--mail",
        type=Path,
        nargs="?",
        const=_CONFIGURED,
        metavar="FILE",
        help="send it as this file says (see examples/mail.toml); without FILE as that of the configuration",
    )


def run(options: Namespace) -> int:
    if options.mail is _CONFIGURED:
        options.mail = configuration().mail
        if options.mail is None:
            raise InputError(
                "--mail FILE: name a file, or write one as mail into the configuration (monitor.toml)"
            )
    if options.mail is not None:
        settings = read_mail_settings(
            options.mail
        )  # what is wrong with it is said before the work, not after
        if settings.password_file is not None and settings.password_file.exists():
            warn_of_readers(settings.password_file)
    request = ReportRequest(
        options.week,
        options.machine,
        options.out,
        ReportOptions(options.model, tuple(options.campaign), options.risk),
        options.workers,
        cluster=options.cluster,
    )
    # Loaded here: --help draws nothing, and what draws takes a second.
    from monitor.workflow.health.report import report

    with opened(options, threads=1, judging=True) as db:
        total = 1 if options.machine else len(ask(db, machines).rows)
        with output.stepping("reporting", total, behind=True, afterwards="writing the pages") as progress:
            answer = replace(ask(db, report, request, progress=progress), mailed_to=())
    unsent = None
    try:
        if options.mail is not None:
            answer = replace(answer, mailed_to=mail_report(options.mail, answer))
    except InputError as error:
        unsent = error  # the report is there all the same, and is printed before what went wrong
    if options.json:
        output.document(answer)
    else:
        _say(answer)
    if unsent is not None:
        raise InputError(f"the report was written, but not sent: {unsent}") from unsent
    return 1 if options.fail_on_alarm and answer.alarms else 0


def _say(answer: ReportAnswer) -> None:
    for each in answer.answers:
        output.say(f"{each.question} {each.sentence}")
    output.table(
        f"week {answer.week}, {answer.from_} to {answer.to}",
        ["machine", "state", "what changed", "since", "P(out)", "next check"],
        [
            [
                row.machine,
                state_in_words(row),
                str(row.changed),
                "-" if row.since is None else f"{row.since:%Y-%m-%d}",
                "-" if row.probability_out is None else f"{row.probability_out:.2g}",
                str(row.next_check),
            ]
            for row in answer.machines
        ],
        text_columns=6,
    )
    if answer.message:
        output.say(str(answer.message))
    for file in answer.files:
        output.say(file)
    for address in answer.mailed_to or ():
        output.say(f"sent to {address}")
