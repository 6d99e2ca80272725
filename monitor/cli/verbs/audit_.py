"""Who changed what and when: the last entries of the audit."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import common
from monitor.workflow import keeping

EXAMPLE = "monitor audit --last 20"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("--last", type=int, default=20, metavar="N", help="how many entries (default 20)")
    parser.add_argument(
        "--containing",
        default="",
        metavar="WORDS",
        help="only entries with all these words in time, user, action, subject or key",
    )
    parser.add_argument(
        "--check",
        action="store_true",
        help="name entries that were edited, removed or put elsewhere, and what has none",
    )


def run(options: Namespace) -> int:
    with opened(options) as db:
        answer = ask(db, keeping.audit, keeping.AuditRequest(options.last, options.check, options.containing))
    if options.json:
        output.document(answer)
    else:
        none = (
            f"no entry holds '{options.containing}'"
            if options.containing.strip()
            else "nothing was written yet"
        )
        output.listing(answer.entries, none)
        for fault in answer.faults or ():
            output.say(fault)
        if answer.faults == ():
            output.say(
                "every entry of the audit is in its place and as it was written, and what is stored has an entry"
            )
    return 1 if answer.faults else 0
