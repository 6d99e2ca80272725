"""Write the database file anew without gaps, compared table by table; the new file takes the place of the old one.

Worth it after `monitor archive`. It waits until nobody else has the database, and needs room for a second file.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from monitor.cli import output
from monitor.cli.database import ask, opened, refuse_server
from monitor.cli.parser import common
from monitor.workflow import retention

EXAMPLE = "monitor compact"


def options(parser: ArgumentParser) -> None:
    common(parser)


def run(options: Namespace) -> int:
    refuse_server(options, "the server has the file; stop it first")
    with opened(options) as db, output.working("compacting"):
        answer = ask(db, retention.compact_database)
    if options.json:
        output.document(answer)
    else:
        output.say(answer.message)
    return 0
