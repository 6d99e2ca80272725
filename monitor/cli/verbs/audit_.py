"""Who changed what and when: the last entries of the audit."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.workflow import keeping

EXAMPLE = "monitor audit --last 20"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("--last", type=int, default=20, metavar="N", help="how many entries (default 20)")


def run(options: Namespace) -> int:
    with opened(options) as db:
        answer = keeping.audit(db, keeping.AuditRequest(options.last))
    if options.json:
        output.document(answer)
    else:
        output.listing(answer.entries, "nothing was written yet")
    return 0
