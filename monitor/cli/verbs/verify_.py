"""Hash everything anew and compare it with the audit: is the database as it was written?"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.workflow import keeping

EXAMPLE = "monitor verify"


def options(parser: ArgumentParser) -> None:
    common(parser)


def run(options: Namespace) -> int:
    with opened(options) as db, output.working("verifying"):
        answer = keeping.verify(db)
    if options.json:
        output.document(answer)
    else:
        for fault in answer.faults:
            output.say(fault)
        verdict = "as it was written" if answer.ok else "NOT as it was written"
        output.say(
            f"{options.db} is {verdict}: {answer.entries} entries, the last with hash {answer.last_sha256}"
        )
    return 0 if answer.ok else 1
