"""List the campaigns in the database."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.workflow.intake import campaigns

EXAMPLE = "monitor campaigns"


def options(parser: ArgumentParser) -> None:
    common(parser)


def run(options: Namespace) -> int:
    with opened(options) as db:
        found = campaigns.campaigns(db)
    if options.json:
        output.document(found)
    else:
        shown = ("campaign", "machine", "method", "runs", "days", "first_run_at", "last_run_at")
        rows = [{**one, **{key: str(one[key])[:10] for key in shown[-2:]}} for one in found["campaigns"]]
        output.listing(rows, "no campaign yet; type `monitor import FOLDER`", shown)
        for one in found["withdrawn"]:
            output.say(f"withdrawn on {one['withdrawn_at'][:10]}: {one['campaign']} ({one['reason']})")
    return 0
