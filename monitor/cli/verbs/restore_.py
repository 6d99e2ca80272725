"""Make a database from a backup, checked against its manifest. An existing file is never overwritten.

Of a folder of backups the newest is put back. `--at` makes the state of a moment: the backup made next after it,
without what was stored later. What is put together so is verified as by `monitor verify`; exit status 1 where that
finds faults.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.moments import moment
from monitor.cli.parser import common
from monitor.workflow import keeping

EXAMPLE = "monitor --db restored.duckdb restore monitor-2026-03-09.duckdb"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("source", type=Path, metavar="FILE", help="a backup, or a folder of backups")
    parser.add_argument(
        "--at",
        metavar="TIME",
        help="the state of this moment: 2026-03-05, 2026-03-05 07:00, or with an offset from UTC",
    )


def run(options: Namespace) -> int:
    at = None if options.at is None else moment(options.at, "--at")
    with output.working("restoring"):
        answer = keeping.restore_backup(keeping.RestoreRequest(options.source, Path(options.db), at))
    return output.checked(answer, answer.message, answer.faults, as_json=options.json)
