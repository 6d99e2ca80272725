"""Write tables as CSV or Parquet files, or as one workbook of Excel."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Literal

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import common
from monitor.workflow import keeping

EXAMPLE = "monitor export shop.xlsx --machine HU40-T"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "folder",
        type=Path,
        metavar="DIR",
        help="a new or empty folder, or a workbook: a file ending in .xlsx",
    )
    parser.add_argument(
        "--format", choices=("csv", "parquet", "xlsx"), dest="format_",
        help="csv (default), parquet, or xlsx: one workbook (extra [excel])",
    )  # fmt: skip
    parser.add_argument(
        "--tables", metavar="NAME,NAME",
        help="only these: views or tables; of a workbook also parameters, 'parameters long', runs, conditions, changes",
    )  # fmt: skip
    parser.add_argument("--machine", metavar="ID", help="only the rows of this machine")


def run(options: Namespace) -> int:
    named: Literal["csv", "xlsx"] = "xlsx" if options.folder.suffix.lower() == ".xlsx" else "csv"
    tables = None if options.tables is None else tuple(name.strip() for name in options.tables.split(","))
    request = keeping.ExportRequest(options.folder, options.format_ or named, tables, options.machine)
    with opened(options) as db, output.working("writing"):
        answer = ask(db, keeping.export, request)
    if options.json:
        output.document(answer)
    else:
        for file in answer.files:
            output.say(str(file))
        for note in answer.notes:
            output.say(f"note: {note}")
    return 0
