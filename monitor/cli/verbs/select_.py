"""Name a selection of the runs of a campaign, list the selections, or set several side by side.

A selection is a group like a day is: `monitor stats hot-cold --select hot-cold-star`, `monitor stats hot-cold --by
hot-cold-star`, `monitor uncertainty hot-cold --select hot-cold-star`. --where takes a condition on run, day, warm_up
(0 or 1), hours (since the first run) and every recorded condition or channel. --compare draws the expanded
uncertainties that follow from several selections or whole campaigns.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import common
from monitor.cli.screen import on_screen
from monitor.exceptions import InputError
from monitor.workflow.selections.request import (
    SelectionAnswer,
    SelectionRequest,
    SelectionsAnswer,
    SelectionsRequest,
    SideBySideAnswer,
    SideBySideRequest,
)
from monitor.workflow.selections.select import select, selections

if TYPE_CHECKING:
    from monitor.store import Database
    from monitor.web.client import Server

EXAMPLE = (
    'monitor select hot-cold --name hot-cold-star --where "hours >= 6"\n'
    "  monitor select --compare hot-cold,hot-cold-star,cold-cold --figures figures"
)


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "campaign",
        metavar="CAMPAIGN",
        nargs="?",
        help="the campaign whose runs are named; not needed with --compare",
    )
    parser.add_argument("--name", metavar="NAME", help="what the selection is to be called")
    parser.add_argument("--where", metavar="CONDITION", help="the runs for which it holds")
    parser.add_argument("--compare", metavar="NAME,NAME", help="selections or campaigns, side by side")
    parser.add_argument("--model", metavar="NAME", help="the model under which they are compared")
    parser.add_argument("--figures", type=Path, metavar="DIR", help="draw the comparison")


def run(options: Namespace) -> int:
    making = options.name is not None or options.where is not None
    if making and (options.campaign is None or options.name is None or options.where is None):
        raise InputError(
            'a selection needs all three: monitor select CAMPAIGN --name NAME --where "hours >= 6"'
        )
    if making and options.compare is not None:
        raise InputError("make the selection first, then --compare it")
    with opened(options, threads=1) as db, output.working("selecting"):
        answer = _answer(db, options)
    if options.json:
        output.document(answer)
    elif isinstance(answer, SelectionAnswer):
        output.say(
            f"{answer.selection}: {len(answer.runs)} runs of {answer.campaign} where {answer.condition}"
        )
    elif isinstance(answer, SideBySideAnswer):
        _comparison(on_screen(answer))
    else:
        output.listing(answer.selections, "there is no selection yet")
    return 0


def _answer(
    db: Database | Server, options: Namespace
) -> SelectionAnswer | SideBySideAnswer | SelectionsAnswer:
    if options.name is not None:
        return ask(db, select, SelectionRequest(options.campaign, options.name, options.where))
    if options.compare is not None:
        names = tuple(name.strip() for name in options.compare.split(",") if name.strip())
        # Loaded here: what compares waits for the solver, what selects or lists does not.
        from monitor.workflow.selections.side_by_side import side_by_side

        return ask(db, side_by_side, SideBySideRequest(names, options.model, figures=options.figures))
    return ask(db, selections, SelectionsRequest(options.campaign))


def _comparison(answer: SideBySideAnswer) -> None:
    scatters = answer.selections
    rows = [
        [
            name,
            unit,
            answer.refers_to.get(name, ""),
            *(
                output.two_digits(scatter.expanded[name]) if name in scatter.expanded else "-"
                for scatter in scatters.values()
            ),
        ]
        for name, unit in answer.units.items()
    ]
    output.table(
        f"expanded uncertainty U = k_q u of a calibration, all parameters together with p = {answer.p:g}",
        [
            "parameter",
            "unit",
            "relative to",
            *(f"{name} ({scatter.runs} runs)" for name, scatter in scatters.items()),
        ],
        rows,
        text_columns=3,
    )
    for file in answer.figures or ():
        output.say(file)
