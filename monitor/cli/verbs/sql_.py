"""Ask the database in SQL: the views v_machines, v_campaigns, v_runs, v_parameters and others, and their tables.

A query may only read. `monitor sql "SHOW TABLES"` lists what there is, `monitor sql "DESCRIBE v_parameters"` the
columns of a view.
"""

from __future__ import annotations

import csv
import sys
from argparse import ArgumentParser, Namespace

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import common
from monitor.exceptions import InputError
from monitor.workflow.query import SqlRequest, TableAnswer, sql

EXAMPLE = (
    'monitor sql "SELECT day, avg(value) AS mean_urad FROM v_parameters '
    "WHERE parameter = 'EB0C' GROUP BY day ORDER BY day\""
)
#: Rows that a terminal shows where the user names no number.
SHOWN = 100


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("query", help="one query in quotes; - reads it from standard input")
    parser.add_argument("--csv", action="store_true", help="all rows as CSV on standard output")
    parser.add_argument(
        "--limit", type=int, metavar="N", help=f"at most N rows (default: {SHOWN} in a table, else all)"
    )


def run(options: Namespace) -> int:
    if options.csv and options.json:
        raise InputError("--csv and --json are two forms of one answer; type one of them")
    query = sys.stdin.read() if options.query == "-" else options.query
    as_table = not (options.csv or options.json)
    limit = SHOWN if options.limit is None and as_table else options.limit
    with opened(options) as db, output.working("asking"):
        answer = ask(db, sql, SqlRequest(query, limit))
    if options.json:
        output.document(answer)
    elif options.csv:
        writer = csv.writer(sys.stdout, lineterminator="\n")
        writer.writerow(answer.columns)
        writer.writerows([output.csv_cell(cell) for cell in row] for row in answer.rows)
    else:
        _table(answer)
    return 0


def _table(answer: TableAnswer) -> None:
    rows = [["-" if cell is None else str(cell) for cell in row] for row in answer.rows]
    output.table("", answer.columns, rows, text_columns=len(answer.columns))
    if answer.truncated:
        output.say(f"the first {len(rows)} rows; --limit N shows more, --csv writes all")
