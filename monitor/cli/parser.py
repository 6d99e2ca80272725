"""The verbs and their options. Every verb is one file of ``verbs``; it is loaded only when it is asked for."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from monitor import __version__
from monitor.cli.database import check_path

#: Verb: what it does in a few words. The file of the same name in ``monitor.cli.verbs`` has the rest.
VERBS = {
    "demo": "the main job on the example campaigns",
    "import": "campaign folders into the database, all or nothing each",
    "withdraw": "take a wrong campaign out, so that its corrected folder can be imported",
    "campaigns": "the campaigns in the database",
    "runs": "the runs of a campaign with their conditions",
    "identify": "geometric errors of every run, stored",
    "stats": "pooled and total covariance, Bartlett, ANOVA, by parameter and by coordinate",
    "trend": "drift, changes, conditions, alarms, forecast of each parameter of a machine",
    "select": "name a selection of the runs of a campaign, to be used as a group",
    "fleet": "all machines at once: what needs attention",
    "uncertainty": "results after JCGM 102, stored",
    "compare": "model against measurement: where it fails",
    "explain": "which physical effect is missing",
    "model": "models and their versions: list, show, add, remove, history",
    "effects": "the catalogue of effects, searchable",
    "map": "volumetric error over the stroke with its uncertainty; compensation tables",
    "plan": "expected uncertainties, blind spots, best next poses",
    "simulate": "a virtual campaign folder, to rehearse",
    "report": "weekly health report of the fleet, HTML and PDF",
    "certificate": "calibration certificates: issue, show, verify, amend, withdraw",
    "event": "record what happened to a machine (crash, repair, compensation)",
    "serve": "pages in a browser and the HTTP interface",
    "verify": "whether the database is as it was written",
    "audit": "who changed what and when",
    "backup": "a second file with everything, checked",
    "restore": "a database from a backup",
    "sql": "a query of your own, which may only read",
    "export": "all tables as CSV or Parquet files",
}
DEFAULT_DATABASE = "monitor.duckdb"
#: Verbs that make a database where there is none, or need none; for all others a missing file is a mistyped name.
WITHOUT_DATABASE = ("demo", "import", "restore", "effects", "serve", "simulate")


class Parser(argparse.ArgumentParser):
    """An argument parser whose refusal is one plain message."""

    def error(self, message: str) -> NoReturn:
        print(f"{self.prog}: {message}; `{self.prog} --help` shows how", file=sys.stderr)
        sys.exit(2)


def _help() -> str:
    lines = [f"  {verb:<12} {summary}" for verb, summary in VERBS.items()]
    return (
        "verbs:\n"
        + "\n".join(lines)
        + "\n\n`monitor VERB --help` shows the options of a verb and an example."
    )


def common(parser: argparse.ArgumentParser, *, database: bool = True) -> None:
    """Add the options that every verb has."""
    if database:
        parser.add_argument("--db", metavar="PATH", default=argparse.SUPPRESS, help="the database file")
    parser.add_argument(
        "--json", action="store_true", help="one JSON document on standard output, nothing else"
    )


def described(summary: str, example: str) -> dict[str, Any]:
    """Return what a subverb is added with: its summary in the list and in its own help, with an example."""
    return {
        "help": summary,
        "description": f"{summary[0].upper()}{summary[1:]}.",
        "epilog": f"example:\n  {example}",
        "formatter_class": argparse.RawDescriptionHelpFormatter,
    }


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the verb's options with its function in ``run``. Ends the program with status 2 on bad usage.

    Raises InputError, NotFoundError for a database that is not there.
    """
    first = Parser(
        prog="monitor",
        description="Long-term health database for machine tools and coordinate measuring machines.",
        epilog=_help(),
        formatter_class=argparse.RawDescriptionHelpFormatter,
        usage="monitor [--db PATH] VERB ...",
    )
    default = os.environ.get("MONITOR_DB") or DEFAULT_DATABASE
    first.add_argument(
        "--db",
        metavar="PATH",
        default=default,
        help=f"the database file (else $MONITOR_DB, else {DEFAULT_DATABASE})",
    )
    first.add_argument("--version", action="version", version=f"monitor {__version__}")
    first.add_argument("verb", nargs="?", metavar="VERB", help=argparse.SUPPRESS)
    first.add_argument("rest", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    head = first.parse_args(arguments)
    if head.verb is None:
        first.print_help()
        sys.exit(2 if arguments else 0)
    if head.verb not in VERBS:
        first.error(f"there is no verb '{head.verb}'; there are {', '.join(VERBS)}")
    parser, run = verb_parser(head.verb)
    database = argparse.Namespace(db=head.db)
    try:
        # People write options before, between and behind the other words.
        options = parser.parse_intermixed_args(head.rest, database)
    except TypeError:
        # A verb with verbs of its own cannot be read so.
        options = parser.parse_args(head.rest, database)
    if not hasattr(options, "run"):
        options.run = run
    check_path(options.db, may_be_new=head.verb in WITHOUT_DATABASE)
    return options


def verb_parser(verb: str) -> tuple[Parser, Callable[[argparse.Namespace], int] | None]:
    """Return the parser of a verb and its function; verbs with verbs of their own set ``run`` themselves."""
    module = importlib.import_module(f"monitor.cli.verbs.{verb}_")
    parser = Parser(
        prog=f"monitor {verb}",
        description=module.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog=f"example:\n  {module.EXAMPLE}",
    )
    module.options(parser)
    return parser, getattr(module, "run", None)
