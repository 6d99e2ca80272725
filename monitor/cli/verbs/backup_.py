"""Copy the whole database into a second file, with a manifest of hashes beside it.

With `--incremental` only what was stored since the newest backup in the same folder: quick and small. To put one back,
those that it follows have to lie beside it. `monitor restore FOLDER --at TIME` makes the state of any moment from them.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import ask, opened, refuse_server
from monitor.cli.parser import common
from monitor.workflow import keeping

EXAMPLE = "monitor backup monitor-2026-03-09.duckdb"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "target", type=Path, metavar="FILE", help="the file of the copy; it must not be there yet"
    )
    parser.add_argument(
        "--incremental",
        action="store_true",
        help="only what was stored since the newest backup in the folder of FILE",
    )


def run(options: Namespace) -> int:
    if options.incremental:
        refuse_server(
            options, "what an incremental backup follows lies beside it; stop the server, or copy everything"
        )
    request = keeping.BackupRequest(options.target, options.incremental)
    with opened(options) as db, output.working("copying"):
        answer = ask(db, keeping.backup, request)
    if options.json:
        output.document(answer)
    else:
        output.say(answer.message)
    return 0
