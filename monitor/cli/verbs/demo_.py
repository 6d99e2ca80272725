"""Run the main job on the example campaigns: import, identify, statistics, what is missing, a certificate."""

from __future__ import annotations

import contextlib
import io
from argparse import ArgumentParser, Namespace
from pathlib import Path
from types import ModuleType

from monitor.cli import output
from monitor.cli.parser import Parser, common
from monitor.cli.verbs import (
    certificate_,
    compare_,
    explain_,
    identify_,
    import_,
    model_,
    report_,
    stats_,
    uncertainty_,
)
from monitor.exceptions import InputError
from monitor.workflow.demo import (
    EXAMPLES,
    FOUND_EFFECT,
    HIDDEN,
    MAIN,
    RUN,
    WEEK,
    examples_folder,
    fresh_database,
)

EXAMPLE = "monitor demo --out demo-output"


def options(parser: ArgumentParser) -> None:
    common(parser, database=False)
    parser.add_argument(
        "--out", type=Path, default=Path("demo-output"), metavar="DIR", help="default: demo-output"
    )


def run(options: Namespace) -> int:
    folder = examples_folder()
    database = fresh_database(options.out)
    figures = options.out / "figures"
    steps: list[tuple[str, ModuleType, list[str]]] = [
        ("import the campaigns", import_, [str(folder / name) for name in EXAMPLES]),
        ("identify the geometric errors of every run", identify_, [MAIN]),
        ("what the days differ in", stats_, [MAIN, "--figures", str(figures / MAIN)]),
        ("uncertainty of all thirteen together", uncertainty_, [MAIN, "--run", str(RUN), "--method", "both"]),
        ("where does the model fail?", compare_, [HIDDEN, "--figures", str(figures / HIDDEN)]),
        ("which effect is missing?", explain_, [HIDDEN, "--figures", str(figures / HIDDEN)]),
        (
            "add it",
            model_,
            ["add", FOUND_EFFECT, "--to", "samba", "--as", "samba-warm", "--campaign", HIDDEN],
        ),
        (
            "watch the error fall",
            model_,
            ["history", "samba-warm", "--campaign", HIDDEN, "--figures", str(figures / HIDDEN)],
        ),
        (
            "a calibration certificate",
            certificate_,
            ["issue", MAIN, "--run", str(RUN), "--laboratory", str(folder / "laboratory.toml"),
             "--out", str(options.out)],
        ),
        (
            "the weekly health report",
            report_,
            ["--week", WEEK, "--campaign", MAIN, "--out", str(options.out)],
        ),
    ]  # fmt: skip
    done = []
    for words, verb, arguments in steps:
        name = verb.__name__.rpartition(".")[2].rstrip("_")
        if not options.json:
            command = " ".join(_quoted(part) for part in ("--db", str(database), name, *arguments))
            output.say(f"\n# {words}\n$ monitor {command}")
        status = _call(verb, name, str(database), arguments, options.json)
        if status != 0:
            raise InputError(f"the step '{words}' ended with status {status}")
        done.append({"step": words, "verb": name, "arguments": arguments})
    files = sorted(str(path) for path in options.out.rglob("*") if path.is_file() and path.suffix != ".svg")
    if options.json:
        output.document({"out": str(options.out), "steps": done, "files": files})
    else:
        output.say(f"\n{options.out} now holds:")
        for file in files:
            output.say(f"  {file}")
    return 0


def _quoted(text: str) -> str:
    return f'"{text}"' if any(sign in text for sign in ' :()*"') else text


def _call(verb: ModuleType, name: str, database: str, arguments: list[str], silent: bool) -> int:
    """Run a verb as a user would type it."""
    parser = Parser(prog=f"monitor {name}")
    verb.options(parser)
    found = parser.parse_args(arguments, Namespace(db=database))
    function = getattr(found, "run", None) or verb.run
    with contextlib.redirect_stdout(io.StringIO()) if silent else contextlib.nullcontext():
        return int(function(found))
