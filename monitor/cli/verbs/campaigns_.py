"""List the campaigns in the database."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from datetime import datetime

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import common
from monitor.workflow.intake import campaigns

EXAMPLE = "monitor campaigns"
#: So many campaigns are named of those that hold copies, or of which the import noticed something.
MOST_NAMED = 10


def options(parser: ArgumentParser) -> None:
    common(parser)


def run(options: Namespace) -> int:
    with opened(options) as db:
        answer = ask(db, campaigns.campaigns)
    if options.json:
        output.document(answer)
        return 0
    rows = [
        {
            "campaign": row.campaign,
            "machine": row.machine,
            "method": f"{row.method}, simulated" if row.simulated else row.method,
            "runs": row.runs if row.rows is None else f"{row.rows} rows",
            "days": row.days,
            "first_run_at": _day(row.first_run_at),
            "last_run_at": _day(row.last_run_at),
        }
        for row in answer.campaigns
    ]
    output.listing(rows, "no campaign yet; type `monitor import FOLDER`")
    for copied in (answer.copied or ())[:MOST_NAMED]:
        output.say(str(copied))
    more = len(answer.copied or ()) - MOST_NAMED
    if more > 0:
        output.say(f"and {more} more hold runs of earlier campaigns; --json has all")
    if answer.noted:
        names = [f"{name} ({count})" for name, count in answer.noted.items()]
        others = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
        output.say(
            f"noticed at the import of {', '.join(names[:MOST_NAMED])}{others}: `monitor runs CAMPAIGN` says what"
        )
    for campaign in answer.withdrawn:
        output.say(f"withdrawn on {campaign.withdrawn_at:%Y-%m-%d}: {campaign.campaign} ({campaign.reason})")
    return 0


def _day(moment: datetime | None) -> str:
    return "" if moment is None else f"{moment:%Y-%m-%d}"
