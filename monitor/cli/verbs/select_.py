"""Name a selection of the runs of a campaign, list the selections, or set several side by side.

A selection is a group like a day is: `monitor stats hot-cold --select hot-cold-star`, `monitor stats hot-cold --by
hot-cold-star`, `monitor uncertainty hot-cold --select hot-cold-star`. --where takes a condition on run, day, warm_up
(0 or 1), hours (since the first run) and every recorded condition or channel. --compare draws the expanded
uncertainties that follow from several selections or whole campaigns.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.exceptions import InputError
from monitor.workflow.selections import select, selections, side_by_side, side_by_side_figure

EXAMPLE = (
    'monitor select hot-cold --name hot-cold-star --where "hours >= 6"\n'
    "  monitor select --compare hot-cold,hot-cold-star,cold-cold --figures figures"
)


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("campaign", metavar="CAMPAIGN", nargs="?")
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
    with opened(options, threads=1) as db, output.working("selecting"), db.transaction():
        if making:
            found = select(db, options.campaign, options.name, options.where)
        elif options.compare is not None:
            names = [name.strip() for name in options.compare.split(",") if name.strip()]
            found = side_by_side(db, names, options.model)
            if options.figures is not None:
                found["figures"] = side_by_side_figure(found, options.figures)
        else:
            found = selections(db, options.campaign)
    if options.json:
        output.document(found)
    elif making:
        output.say(
            f"{found['selection']}: {len(found['runs'])} runs of {found['campaign']} where {found['condition']}"
        )
    elif options.compare is not None:
        _comparison(found)
    else:
        output.listing(found["selections"], "there is no selection yet")
    return 0


def _comparison(found: dict[str, Any]) -> None:
    parts = found["selections"]
    units: dict[str, str] = {}
    for one in parts.values():
        units |= one["units"]
    rows = [
        [name, unit, *(
            output.two_digits(one["expanded"][name]) if name in one["expanded"] else "-" for one in parts.values()
        )]
        for name, unit in units.items()
    ]  # fmt: skip
    output.table(
        f"expanded uncertainty U = k_q u of a calibration, all parameters together with p = {found['p']:g}",
        ["parameter", "unit", *(f"{name} ({one['runs']} runs)" for name, one in parts.items())], rows, text_columns=2,
    )  # fmt: skip
    for file in found.get("figures", []):
        output.say(file)
