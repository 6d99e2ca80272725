"""List the runs of a campaign with their conditions."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import common
from monitor.workflow.intake import campaigns

EXAMPLE = "monitor runs five-days"
#: What a table shows; every condition stands under the name that the folder gives it.
COLUMNS = ("campaign", "machine", "run", "started_at_local", "day", "warm_up", "conditions")


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "campaign", metavar="CAMPAIGN", help="a campaign of the database (monitor campaigns lists them)"
    )


def run(options: Namespace) -> int:
    with opened(options) as db:
        answer = ask(db, campaigns.runs, campaigns.RunsRequest(options.campaign))
    if options.json:
        output.document(answer)
    else:
        output.listing(answer.runs, "no run", COLUMNS)
        for note in answer.notes:
            output.say(f"note: {note}")
    return 0
