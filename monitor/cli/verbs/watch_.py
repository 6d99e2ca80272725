"""Watch a folder: campaign folders, and zips of them, that came and are at rest are imported, identified and told.

A bad one is named once with its faults; it is looked at again when a file of it changes. Nothing in the folder is moved
or changed. `--once` looks once and ends, for a scheduler; without it the verb looks until it is stopped.
"""

from __future__ import annotations

import sys
import time
from argparse import ArgumentParser, Namespace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from monitor.cli import output
from monitor.cli.configuration import configuration
from monitor.cli.database import opened_file, refuse_server
from monitor.cli.garbage import collect_as_usual
from monitor.cli.parser import common
from monitor.cli.secret_files import warn_of_readers
from monitor.exceptions import InputError

if TYPE_CHECKING:
    from monitor.workflow.watching.request import WatchAnswer, WatchRequest

EXAMPLE = "monitor watch /srv/measured --out reports-out --mail mail.toml"
#: Stands for --mail without a file.
_CONFIGURED = Path()


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "folder", type=Path, metavar="FOLDER", help="where campaign folders and zips are copied to"
    )
    parser.add_argument("--once", action="store_true", help="look once and end")
    parser.add_argument(
        "--every", type=float, default=60.0, metavar="SECONDS",
        help="pause between two looks (default 60)",
    )  # fmt: skip
    parser.add_argument(
        "--rest", type=float, default=30.0, metavar="SECONDS",
        help="a folder is complete when nothing in it was written for so long (default 30)",
    )  # fmt: skip
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="write the health report of what came there; default: no report",
    )
    parser.add_argument(
        "--mail", type=Path, nargs="?", const=_CONFIGURED, metavar="FILE",
        help="tell by e-mail as this file says (see examples/mail.toml); without FILE as that of the configuration",
    )  # fmt: skip


def run(options: Namespace) -> int:
    # What identifies and draws is loaded once it is known that there is something to do.
    from monitor.workflow.health.mail import read_mail_settings
    from monitor.workflow.watching.request import WatchRequest

    if options.json and not options.once:
        raise InputError("--json writes one document: add --once")
    if not 1.0 <= options.every <= 86400.0:
        raise InputError(f"--every {options.every:g}: seconds between two looks, from 1 to 86400")
    if options.mail is _CONFIGURED:
        options.mail = configuration().mail
        if options.mail is None:
            raise InputError("--mail FILE: name a file, or write one as mail into the configuration")
    if options.mail is not None:
        settings = read_mail_settings(options.mail)
        if settings.password_file is not None and settings.password_file.exists():
            warn_of_readers(settings.password_file)
    request = WatchRequest(options.folder, options.rest, options.out, options.mail)
    if options.once:
        return _look(options, request)
    output.say(f"watching {options.folder}, every {options.every:g} s; Ctrl-C ends it")
    said = ""
    collect_as_usual()
    while True:
        try:
            _look(options, request)
            said = ""
        except InputError as error:
            # A share that went away, a mail server that does not answer: said once, tried again.
            if str(error) != said:
                said = str(error)
                print(f"monitor: {datetime.now():%Y-%m-%d %H:%M}: {said}", file=sys.stderr, flush=True)
        sys.stdout.flush()
        time.sleep(options.every)


def _look(options: Namespace, request: WatchRequest) -> int:
    """Look once and say what came; exit status 2 where something was refused."""
    from monitor.web.access import NOT_OFFERED
    from monitor.workflow.watching.letter import lines_of
    from monitor.workflow.watching.watch import watch

    refuse_server(options, NOT_OFFERED["watch"])
    with opened_file(options, threads=1, judging=True) as db, output.working("taking in"):
        answer = watch(db, request)
    if options.json:
        output.document(answer)
        return 2 if answer.refused else 0
    if not options.once and not answer.news:
        return 0
    if not options.once:
        output.say(f"{datetime.now():%Y-%m-%d %H:%M}")
    for line in (*lines_of(answer), *(_left_for_later(answer) if options.once else ()), *_written(answer)):
        output.say(line)
    if options.once and not answer.news and not answer.waiting:
        output.say(f"nothing new in {options.folder}")
    return 2 if answer.refused else 0


def _left_for_later(answer: WatchAnswer) -> list[str]:
    return [f"left for the next look: {waiting.arrival}: {waiting.why}" for waiting in answer.waiting]


def _written(answer: WatchAnswer) -> list[str]:
    """The states of the report's machines, its files, and to whom a letter went."""
    from monitor.reporting.health.records import state_in_words

    report = answer.report
    lines = [] if report is None else [f"{row.machine}: {state_in_words(row)}" for row in report.machines]
    lines += [] if report is None else report.files
    return [*lines, *(f"sent to {address}" for address in answer.mailed_to)]
