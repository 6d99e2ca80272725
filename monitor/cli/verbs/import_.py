"""Import campaign folders, all or nothing each. A folder that was imported before changes nothing.

Where several are named, one that is refused does not hinder the others: exit status 2 says that there was one.
Files of instruments become one campaign by a mapping of their columns (docs/files-as-they-come.md).
"""

from __future__ import annotations

import sys
import tempfile
from argparse import ArgumentParser, Namespace
from contextlib import ExitStack
from pathlib import Path

from monitor.cli import output, understood_output
from monitor.cli.database import ask, opened
from monitor.cli.folder_patterns import in_full
from monitor.cli.parser import common
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLE = "monitor import examples/five-days examples/cold-cold"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "folder", nargs="+", type=Path, metavar="FOLDER",
        help="a campaign folder, a folder with mapping.toml, or with --mapping a file of an instrument",
    )  # fmt: skip
    parser.add_argument(
        "--mapping",
        type=Path,
        metavar="FILE",
        help="what the columns of instruments' files are; they make one campaign",
    )
    parser.add_argument(
        "--campaign", metavar="NAME", help="the name of that campaign instead of the mapping's"
    )
    parser.add_argument("--dry-run", action="store_true", help="say what was understood, and store nothing")


def run(options: Namespace) -> int:
    request = ImportRequest(in_full(options.folder), options.mapping, options.campaign, options.dry_run)
    with ExitStack() as stack:
        if options.dry_run and options.server is None and not Path(options.db).exists():
            # Nothing is stored, and no database is left behind either.
            folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="monitor-"))
            options.db = str(Path(folder) / "dry-run.duckdb")
        with (
            opened(options) as db,
            output.stepping("importing", len(request.folders)) as progress,
        ):
            answer = ask(db, import_folders, request, progress=progress)
    if options.json:
        output.document(answer)
    else:
        for imported in answer.imported:
            understood_output.show(imported.understood)
            output.say(imported.message)
            for note in imported.notes:
                output.say(f"note: {note}")
        for file in answer.passed_over or ():
            output.say(f"note: {file} passed over: the true values of a rehearsal, no campaign")
    for refused in answer.refused:
        print(f"monitor: {refused.why}", file=sys.stderr)
    if answer.refused:
        names = ", ".join(refused.folder for refused in answer.refused)
        count, every = len(answer.refused), len(answer.refused) + len(answer.imported)
        print(f"monitor: {count} of {every} folders refused: {names}", file=sys.stderr)
    return 2 if answer.refused else 0
