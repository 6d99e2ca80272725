"""Import campaign folders, all or nothing each. A folder that was imported before changes nothing.

Where several are named, one that is refused does not hinder the others: exit status 2 says that there was one.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import common
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLE = "monitor import examples/five-days examples/cold-cold"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("folder", nargs="+", type=Path, metavar="FOLDER", help="a campaign folder, format 1")


def run(options: Namespace) -> int:
    request = ImportRequest(options.folder)
    with opened(options) as db, output.stepping("importing", len(request.folders)) as progress:
        answer = ask(db, import_folders, request, progress=progress)
    if options.json:
        output.document(answer)
    else:
        for folder in answer.imported:
            output.say(folder.message)
            for note in folder.notes:
                output.say(f"note: {note}")
    for refused in answer.refused:
        print(f"monitor: {refused.why}", file=sys.stderr)
    if answer.refused:
        names = ", ".join(refused.folder for refused in answer.refused)
        count = len(answer.refused)
        print(f"monitor: {count} of {len(request.folders)} folders refused: {names}", file=sys.stderr)
    return 2 if answer.refused else 0
