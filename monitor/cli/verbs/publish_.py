"""Publish what was stored since the last time to a lake that holds many plants.

A lake is read like a database: `monitor --db ADDRESS fleet`. Whatever breaks in between, the next call goes on where
this one ended, and nothing is added twice.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import common

EXAMPLE = "monitor publish --to 'ducklake:postgres:dbname=lake host=db.example.org' --plant Ulm"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "--to", required=True, metavar="ADDRESS",
        help="the lake: 'ducklake:postgres:dbname=... host=...', or ducklake:FILE for one process at a time",
    )  # fmt: skip
    parser.add_argument(
        "--files",
        metavar="FOLDER",
        help="where a new lake keeps its Parquet files: a folder, or s3://BUCKET/FOLDER; makes the lake",
    )
    parser.add_argument(
        "--plant", metavar="NAME",
        help="name of this database in the lake, at its first publication (default: that of its file)",
    )  # fmt: skip


def run(options: Namespace) -> int:
    # Loaded here: what publishes needs the engine, and `--help` does not.
    from monitor.workflow.publishing import PublishRequest, publish

    request = PublishRequest(options.to, options.files, options.plant)
    with opened(options) as db, output.working("publishing"):
        answer = ask(db, publish, request, progress=_tell)
    if options.json:
        output.document(answer)
    elif answer.entries:
        output.say(
            f"{answer.plant}: {answer.entries} entries of the audit published with {answer.rows} rows; "
            f"the lake holds it up to entry {answer.last_entry}"
        )
    else:
        output.say(f"{answer.plant}: nothing new; the lake holds it up to entry {answer.last_entry}")
    return 0


def _tell(fault: str) -> None:
    print(
        f"monitor: the lake has not taken it yet, trying again for some minutes: {fault}",
        file=sys.stderr,
        flush=True,
    )
