"""Run the main job on the example campaigns: import, identify, statistics, what is missing, a certificate."""

from __future__ import annotations

import contextlib
import io
from argparse import ArgumentParser, Namespace
from pathlib import Path
from types import ModuleType

from monitor.cli import output
from monitor.cli.database import PATIENCE_S
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
    DemoAnswer,
    DemoStep,
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
    steps = []
    for text, verb, arguments in _steps(folder, options.out):
        name = verb.__name__.rpartition(".")[2].rstrip("_")
        if not options.json:
            command = " ".join(_quoted(part) for part in ("--db", str(database), name, *arguments))
            output.say(f"\n# {text}\n$ monitor {command}")
        status = _call(verb, name, str(database), arguments, options.json)
        if status != 0:
            raise InputError(f"the step '{text}' ended with status {status}")
        steps.append(DemoStep(text, name, tuple(arguments)))
    files = sorted(str(path) for path in options.out.rglob("*") if path.is_file() and path.suffix != ".svg")
    if options.json:
        output.document(DemoAnswer(options.out, tuple(steps), tuple(files)))
    else:
        output.say(f"\n{options.out} now holds:")
        for file in files:
            output.say(f"  {file}")
    return 0


def _steps(examples: Path, out: Path) -> list[tuple[str, ModuleType, list[str]]]:
    """Return what each step is, its verb, and the arguments of the verb."""
    figures = out / "figures"
    return [
        ("import the campaigns", import_, [str(examples / name) for name in EXAMPLES]),
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
            ["issue", MAIN, "--run", str(RUN), "--laboratory", str(examples / "laboratory.toml"),
             "--out", str(out)],
        ),
        (
            "the weekly health report",
            report_,
            ["--week", WEEK, "--campaign", MAIN, "--out", str(out)],
        ),
    ]  # fmt: skip


def _quoted(text: str) -> str:
    return f'"{text}"' if any(sign in text for sign in ' :()*"') else text


def _call(verb: ModuleType, name: str, database: str, arguments: list[str], silent: bool) -> int:
    """Run a verb as a user would type it."""
    parser = Parser(prog=f"monitor {name}")
    verb.options(parser)
    options = parser.parse_args(
        arguments, Namespace(db=database, wait=PATIENCE_S, server=None, server_token=None, alone=False)
    )
    function = getattr(options, "run", None) or verb.run
    with contextlib.redirect_stdout(io.StringIO()) if silent else contextlib.nullcontext():
        return int(function(options))
