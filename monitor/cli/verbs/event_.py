"""Record what happened to a machine (crash, repair, compensation, another probe), or list what was recorded.

An event splits the history of all parameters: `trend`, `fleet` and the health report follow the machine from its
last event on. A note is only shown with the history. The same twice, a usual kind that is misspelt and an event more
than a year before the first run are refused; what was recorded wrongly is withdrawn with a reason.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.moments import moment
from monitor.cli.parser import common
from monitor.exceptions import InputError
from monitor.store import NOTE
from monitor.workflow.events import USUAL_KINDS, EventRequest, WithdrawEventRequest, event, withdraw

EXAMPLE = 'monitor event HU40-T --at 2026-03-05T07:00:00-05:00 --kind repair "B axis encoder changed"'


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("machine", metavar="MACHINE", help="a machine of the database, by its id")
    parser.add_argument(
        "text", nargs="?", metavar="TEXT", help="what happened; without it the events are listed"
    )
    parser.add_argument(
        "--at",
        metavar="TIME",
        help="when it happened: 2026-03-05, 2026-03-05 07:00, or with an offset from UTC; needed with TEXT",
    )
    parser.add_argument(
        "--before-runs", action="store_true", help="it did happen more than a year before the first run"
    )
    parser.add_argument(
        "--withdraw", type=int, metavar="N", help="take event N of the list away, with --reason"
    )
    parser.add_argument("--reason", metavar="TEXT", help="why it is withdrawn, in words; it is kept")
    parser.add_argument(
        "--kind",
        default="note",
        help=f"a word: {', '.join(USUAL_KINDS)}; note (the default) where nothing changed the machine",
    )


def run(options: Namespace) -> int:
    if options.withdraw is not None or options.reason is not None:
        return _withdrawn(options)
    request = EventRequest(
        options.machine,
        options.text,
        None if options.at is None else moment(options.at, "--at"),
        options.kind,
        options.before_runs,
    )
    with opened(options) as db:
        answer = ask(db, event, request)
    if options.json:
        output.document(answer)
        return 0
    output.listing(answer.events, "no event is recorded that counts")
    for note in answer.notes:
        output.say(f"note: {note}")
    if options.text is not None and options.kind == NOTE:
        output.say(
            "recorded as a note, which does not split the history; "
            f"--kind {', '.join(USUAL_KINDS)} or another word does"
        )
    return 0


def _withdrawn(options: Namespace) -> int:
    """Take an event away, and list those that stay."""
    if options.withdraw is None or options.text is not None or options.at is not None:
        raise InputError(
            'an event is withdrawn by --withdraw N --reason "the year was mistyped", with neither text nor time; '
            "without text the events are listed with their numbers"
        )
    request = WithdrawEventRequest(options.machine, options.withdraw, options.reason or "")
    with opened(options) as db:
        answer = ask(db, withdraw, request)
    if options.json:
        output.document(answer)
        return 0
    output.say(f"event {options.withdraw} of {options.machine} is withdrawn; it stays in the audit")
    output.listing(answer.events, "no event is left")
    return 0
