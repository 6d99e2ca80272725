"""Write every table as a CSV or Parquet file."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.workflow import keeping

EXAMPLE = "monitor export tables --format csv"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument(
        "--format", choices=("csv", "parquet"), default="csv", dest="format_", help="csv (default) or parquet"
    )


def run(options: Namespace) -> int:
    with opened(options) as db, output.working("writing"):
        answer = keeping.export(db, keeping.ExportRequest(options.folder, options.format_))
    if options.json:
        output.document(answer)
    else:
        for file in answer.files:
            output.say(str(file))
    return 0
