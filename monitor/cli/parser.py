"""The verbs and their options. Every verb is one file of ``verbs``; it is loaded only when it is asked for."""

from __future__ import annotations

import argparse
import importlib
import os
import re
import sys
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from monitor import __version__
from monitor.cli.database import PATIENCE_S, check_path, seconds_to_wait
from monitor.exceptions import InputError, did_you_mean

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
    "predict": "what a fitted model says of rows that took no part in its fit",
    "model": "models and their versions: list, show, add, remove, history",
    "effects": "the catalogue of effects, searchable",
    "map": "volumetric error over the stroke with its uncertainty; compensation tables",
    "contributions": "what each instrument does for each parameter, and whether they agree",
    "standards": "what ISO 230-2, 230-4 and 230-6 report of laser and ball-bar tests",
    "plan": "expected uncertainties, blind spots, best next poses",
    "simulate": "a virtual campaign folder, to rehearse",
    "report": "weekly health report of the fleet, HTML and PDF",
    "certificate": "calibration certificates: issue, show, verify, amend, withdraw, template",
    "watch": "a folder: campaigns that come are imported, identified, reported and told",
    "event": "record what happened to a machine (crash, repair, compensation)",
    "serve": "pages in a browser and the HTTP interface",
    "verify": "whether the database is as it was written",
    "audit": "who changed what and when",
    "backup": "a second file with everything, checked",
    "restore": "a database from a backup",
    "archive": "imported files of old campaigns out of the database into a folder",
    "compact": "the database file written anew without gaps",
    "publish": "what was stored since the last time to a lake of many plants",
    "sql": "a query of your own, which may only read",
    "export": "tables as CSV or Parquet files, or as one workbook of Excel",
    "config": "the configuration of this place: show, check, init",
    "completion": "completion of verbs and options by the tab key, for bash, zsh or fish",
}
DEFAULT_DATABASE = "monitor.duckdb"
#: Verbs that make a database where there is none, or need none; for all others a missing file is a mistyped name.
WITHOUT_DATABASE = (
    "demo",
    "import",
    "watch",
    "restore",
    "effects",
    "serve",
    "simulate",
    "config",
    "completion",
)

#: Verbs that work on files of this computer alone; they ask no server.
AT_HOME = ("demo", "restore", "serve", "watch", "config", "completion")
SUBVERBS_WITHOUT_DATABASE = ("template",)


#: What argparse says of a number, and what would be right.
_SAID_OF_NUMBERS = {
    "invalid int value: (.*)$": r"a whole number, such as 3, not \1",
    "invalid float value: (.*)$": r"a number, such as 0.95, not \1",
}


class _TypedOnce(argparse.Action):
    """Takes one value; refuses a second one, of which argparse would take the last without a word."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        if option_string is not None and isinstance(parser, Parser):
            if self.dest in parser.typed:
                raise argparse.ArgumentError(self, "one value is taken, a second one was typed")
            parser.typed.add(self.dest)
        setattr(namespace, self.dest, values)


class Parser(argparse.ArgumentParser):
    """An argument parser whose refusal is one plain message."""

    def __init__(self, *arguments: Any, **keywords: Any) -> None:
        super().__init__(*arguments, **keywords)
        #: Options that were typed, among those of one value.
        self.typed: set[str] = set()
        for action in (None, "store"):
            self.register("action", action, _TypedOnce)

    def parse_known_args(self, *arguments: Any, **keywords: Any) -> Any:
        """Parse as argparse does; what was typed the time before is forgotten."""
        self.typed.clear()
        return super().parse_known_args(*arguments, **keywords)

    def error(self, message: str) -> NoReturn:
        hint = self._hint(message)
        for wrong, right in _SAID_OF_NUMBERS.items():
            message = re.sub(wrong, right, message)
        print(f"{self.prog}: {message}; {hint}`{self.prog} --help` shows how", file=sys.stderr)
        sys.exit(2)

    def _hint(self, message: str) -> str:
        """Return the nearest option or choice to the one that a message of argparse refuses."""
        if choice := re.search(r"invalid choice: '(.*?)' \(choose from (.*)\)$", message):
            return did_you_mean(choice[1], re.findall(r"[\w.-]+", choice[2]))
        if option := re.search(r"unrecognized arguments:.*?(--[\w-]+)", message):
            return did_you_mean(option[1], self._option_string_actions)
        return ""


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
            "--wait", metavar="SECONDS", default=argparse.SUPPRESS,
            help=f"how long to wait for another process that has the database (default {PATIENCE_S:g})",
        )  # fmt: skip
        parser.add_argument(
            "--server", metavar="URL", default=argparse.SUPPRESS,
            help="ask the server at this address instead of a database file",
        )  # fmt: skip
        parser.add_argument(
            "--server-token", metavar="FILE", default=argparse.SUPPRESS,
            help="the file that holds your token of that server",
        )  # fmt: skip
    parser.add_argument(
        "--json", action="store_true", help="one JSON document on standard output, nothing else"
    )
    parser.add_argument(
        "--quiet", action="store_true", help="nothing but messages of what went wrong, and the exit status"
    )


def add_model(parser: argparse.ArgumentParser) -> None:
    """Add the option of the model under which a campaign is looked at."""
    parser.add_argument(
        "--model",
        metavar="NAME",
        help="a model, or a version of it: NAME@2 (default: that of the campaign's method)",
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
        usage="monitor [--db PATH | --server URL] VERB ...",
    )
    first.add_argument(
        "--db",
        metavar="PATH",
        help=f"the database file (else $MONITOR_DB, else that of the configuration, else {DEFAULT_DATABASE})",
    )
    first.add_argument(
        "--wait",
        metavar="SECONDS",
        default=os.environ.get("MONITOR_WAIT") or f"{PATIENCE_S:g}",
        help=f"how long to wait for another process that has the database (else $MONITOR_WAIT, else {PATIENCE_S:g})",
    )
    first.add_argument(
        "--server", metavar="URL", help="ask the server at this address instead (else $MONITOR_SERVER)"
    )
    first.add_argument(
        "--server-token", metavar="FILE",
        help="the file that holds your token of that server (else $MONITOR_SERVER_TOKEN_FILE, else the token itself in "
        "$MONITOR_SERVER_TOKEN)",
    )  # fmt: skip
    # People write these before the verb as well as behind it.
    first.add_argument("--json", action="store_true", help=argparse.SUPPRESS)
    first.add_argument("--quiet", action="store_true", help=argparse.SUPPRESS)
    first.add_argument("--version", action="version", version=f"monitor {__version__}")
    first.add_argument("verb", nargs="?", metavar="VERB", help=argparse.SUPPRESS)
    first.add_argument("rest", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    head = first.parse_args(arguments)
    if head.verb is None:
        first.print_help()
        sys.exit(2 if arguments else 0)
    if head.verb not in VERBS:
        hint = did_you_mean(head.verb, VERBS)
        first.error(f"there is no verb '{head.verb}'; {hint}there are {', '.join(VERBS)}")
    parser, run = verb_parser(head.verb)
    # argparse takes a -- right behind the verb as the end of that.
    behind = list(arguments[len(arguments) - len(head.rest) - 1 :])
    options = _read_behind_verb(parser, behind if behind[0] == "--" else head.rest)
    _join(first, head, options)
    if not hasattr(options, "run"):
        options.run = run
    options.wait = seconds_to_wait(options.wait)
    _choose_server(head.verb, options)
    if options.server is not None:
        options.db = options.server  # what messages name
        return options
    if options.db is None:
        options.db = _default_database(head.verb)
    needs_none = head.verb in WITHOUT_DATABASE or getattr(options, "what", None) in SUBVERBS_WITHOUT_DATABASE
    check_path(options.db, may_be_new=needs_none)
    return options


def _read_behind_verb(parser: Parser, arguments: list[str]) -> argparse.Namespace:
    # What stands behind -- is no option, as the name -x of a campaign: argparse forgets that between its two rounds.
    if "--" not in arguments:
        try:
            # People write options before, between and behind the other words.
            return parser.parse_intermixed_args(arguments)
        except TypeError:
            pass  # a verb with verbs of its own cannot be read so
    return parser.parse_args(arguments)


def _join(first: Parser, head: argparse.Namespace, options: argparse.Namespace) -> None:
    """Add what was typed before the verb to what was typed behind it; end the program where both name one thing."""
    for name in ("db", "wait", "server", "server_token"):
        if name in options and name in first.typed:
            option = f"--{name.replace('_', '-')}"
            first.error(f"argument {option}: one value is taken, a second one was typed behind `{head.verb}`")
        if name not in options:
            setattr(options, name, getattr(head, name))
    options.json, options.quiet = options.json or head.json, options.quiet or head.quiet


def _choose_server(verb: str, options: argparse.Namespace) -> None:
    """Settle whether a server or a file is asked: what is typed stands above the environment.

    Raises InputError where both are typed, and for a verb that works on files of this computer alone.
    """
    if options.server is not None and options.db is not None:
        raise InputError("--db names a file and --server a server that has one: give one of the two")
    if options.server is not None and verb in AT_HOME:
        raise InputError(f"`monitor {verb}` works on files of this computer and is not asked of a server")
    if options.server is None and options.db is None and verb not in AT_HOME:
        options.server = os.environ.get("MONITOR_SERVER") or None


def _default_database(verb: str) -> str:
    """The database where none is typed: of the environment, of the configuration, or the usual one."""
    named = os.environ.get("MONITOR_DB")
    if named or verb in ("config", "completion"):
        return named or DEFAULT_DATABASE
    from monitor.cli.configuration import configuration

    configured = configuration().database
    return DEFAULT_DATABASE if configured is None else str(configured)


def verb_options(verb: str) -> Callable[[argparse.ArgumentParser], None]:
    """Return what adds the options of a verb to a parser."""
    options: Callable[[argparse.ArgumentParser], None] = importlib.import_module(
        f"monitor.cli.verbs.{verb}_"
    ).options
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
