"""Record what happened to a machine (crash, repair, compensation, another probe), or list what was recorded.

An event splits the history of all parameters: `trend`, `fleet` and the health report follow the machine from its
last event on. A note is only shown with the history. Neither can be undone, so the same twice and a usual kind that is
misspelt are refused.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.moments import moment
from monitor.cli.parser import common
from monitor.store import NOTE
from monitor.workflow.events import USUAL_KINDS, EventRequest, event

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
        "--kind",
        default="note",
        help=f"a word: {', '.join(USUAL_KINDS)}; note (the default) where nothing changed the machine",
    )


def run(options: Namespace) -> int:
    request = EventRequest(
        options.machine,
        options.text,
        None if options.at is None else moment(options.at, "--at"),
        options.kind,
    )
    with opened(options) as db:
        answer = ask(db, event, request)
    if options.json:
        output.document(answer)
        return 0
    output.listing(answer.events, "nothing was recorded yet")
    for note in answer.notes:
        output.say(f"note: {note}")
    if options.text is not None and options.kind == NOTE:
        output.say(
            "recorded as a note, which does not split the history; "
            f"--kind {', '.join(USUAL_KINDS)} or another word does"
        )
    return 0
