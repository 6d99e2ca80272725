"""List the runs of a campaign with their conditions."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.workflow.intake import campaigns

EXAMPLE = "monitor runs five-days"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("campaign", metavar="CAMPAIGN")


def run(options: Namespace) -> int:
    with opened(options) as db:
        answer = campaigns.runs(db, campaigns.RunsRequest(options.campaign))
    if options.json:
        output.document(answer)
    else:
        output.listing(answer.runs, "no run")
        for note in answer.notes:
            output.say(f"note: {note}")
    return 0
