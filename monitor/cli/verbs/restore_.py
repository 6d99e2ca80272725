"""Make a database from a backup, checked against its manifest. An existing file is never overwritten."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.parser import common
from monitor.workflow import keeping

EXAMPLE = "monitor --db restored.duckdb restore monitor-2026-03-09.duckdb"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("source", type=Path, metavar="FILE")


def run(options: Namespace) -> int:
    with output.working("restoring"):
        answer = keeping.restore_backup(keeping.RestoreRequest(options.source, Path(options.db)))
    if options.json:
        output.document(answer)
    else:
        output.say(answer.message)
    return 0
