"""Find which physical effect is missing, with cause and remedy; or say that nothing is, or that data cannot decide."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import add_model, common
from monitor.cli.screen import on_screen
from monitor.workflow.explain.request import RATE, ExplainRequest

EXAMPLE = "monitor explain hidden-spindle-growth --figures figures"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "campaign", metavar="CAMPAIGN", help="a campaign of the database (monitor campaigns lists them)"
    )
    add_model(parser)
    parser.add_argument(
        "--rate", type=float, default=RATE, metavar="Q", help=f"false discovery rate (default {RATE:g})"
    )
    parser.add_argument(
        "--figures", type=Path, metavar="DIR", help="draw what is missing and how the error falls"
    )


def run(options: Namespace) -> int:
    # Loaded here: --help searches nothing.
    from monitor.cli import explain_output
    from monitor.workflow.explain.explain import explain

    # One transaction: figures that cannot be drawn leave no result behind.
    with opened(options) as db, output.working("searching"):
        answer = ask(
            db, explain, ExplainRequest(options.campaign, options.model, options.rate, options.figures)
        )
    if options.json:
        output.document(answer)
    else:
        explain_output.show(on_screen(answer))
    return 0
