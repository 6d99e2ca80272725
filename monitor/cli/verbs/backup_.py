"""Copy the whole database into a second file, with a manifest of hashes beside it."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import common
from monitor.workflow import keeping

EXAMPLE = "monitor backup monitor-2026-03-09.duckdb"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("target", type=Path, metavar="FILE")


def run(options: Namespace) -> int:
    with opened(options) as db, output.working("copying"):
        answer = ask(db, keeping.backup, keeping.BackupRequest(options.target))
    if options.json:
        output.document(answer)
    else:
        output.say(answer.message)
    return 0
