"""Move the imported files of old campaigns out of the database into a folder, or check that folder.

What was read from the files stays, and so do their hashes: results, certificates and `monitor verify` need no more.
The audit says who moved which files when. Without `--before` every file that was moved is compared with its hash.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import ask, opened, refuse_server
from monitor.cli.moments import moment
from monitor.cli.parser import common
from monitor.workflow import retention

EXAMPLE = "monitor archive /mnt/archive --before 2024-01-01"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "folder", type=Path, metavar="FOLDER", help="where the files go, or where those that went are checked"
    )
    parser.add_argument(
        "--before",
        metavar="TIME",
        help="files of the campaigns that were imported before; without it the folder is checked",
    )
    parser.add_argument("--machine", metavar="ID", help="only those of this machine")


def run(options: Namespace) -> int:
    before = None if options.before is None else moment(options.before, "--before")
    request = retention.ArchiveRequest(options.folder, before, options.machine)
    refuse_server(options, "files are moved on the computer that has the database; stop the server first")
    with opened(options) as db, output.working("archiving"):
        answer = ask(db, retention.archive, request)
    return output.checked(answer, answer.message, answer.faults, as_json=options.json)
