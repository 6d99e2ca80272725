"""Import campaign folders, all or nothing each. A folder that was imported before changes nothing."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLE = "monitor import examples/five-days examples/cold-cold"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("folder", nargs="+", type=Path, metavar="FOLDER", help="a campaign folder, format 1")


def run(options: Namespace) -> int:
    request = ImportRequest(options.folder)
    with opened(options) as db, output.stepping("importing", len(request.folders)) as progress:
        answer = import_folders(db, request, progress=progress)
    if options.json:
        output.document(answer)
    else:
        for folder in answer.imported:
            output.say(folder.message)
            for note in folder.notes:
                output.say(f"note: {note}")
    return 0
