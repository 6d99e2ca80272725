"""Write what lets a shell complete verbs, options and files with the tab key, for bash, zsh or fish."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import dataclass

from monitor.cli import output
from monitor.cli.parser import VERBS, Parser, common, verb_options
from monitor.exceptions import InputError

EXAMPLE = "monitor completion bash > ~/.local/share/bash-completion/completions/monitor"
SHELLS = ("bash", "zsh", "fish")


@dataclass(frozen=True)
class CompletionAnswer:
    """The script for a shell."""

    shell: str
    script: str


def options(parser: ArgumentParser) -> None:
    common(parser, database=False)
    parser.add_argument("shell", choices=SHELLS, metavar="|".join(SHELLS), help="the shell")


def run(options: Namespace) -> int:
    try:
        import shtab
    except ImportError as error:
        raise InputError(
            "completion needs shtab: pip install 'machine-health-monitor[completion]'"
        ) from error
    whole = Parser(prog="monitor")
    whole.add_argument("--db", metavar="PATH", help="the database file")
    verbs = whole.add_subparsers(metavar="VERB")
    for verb, summary in VERBS.items():
        verb_options(verb)(verbs.add_parser(verb, help=summary))
    answer = CompletionAnswer(options.shell, shtab.complete(whole, shell=options.shell))
    if options.json:
        output.document(answer)
    else:
        output.say(answer.script)
    return 0
