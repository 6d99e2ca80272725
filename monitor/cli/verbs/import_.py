"""Import campaign folders, all or nothing each. A folder that was imported before changes nothing."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.workflow.intake import campaigns

EXAMPLE = "monitor import examples/five-days examples/cold-cold"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("folder", nargs="+", type=Path, metavar="FOLDER", help="a campaign folder, format 1")


def run(options: Namespace) -> int:
    with opened(options) as db, output.stepping("importing", len(options.folder)) as begin:
        found = campaigns.import_folders(db, options.folder, begin)
    if options.json:
        output.document(found)
    else:
        for one in found["imported"]:
            output.say(one["message"])
            for note in one["notes"]:
                output.say(f"note: {note}")
    return 0
