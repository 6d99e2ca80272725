"""Search the catalogue of effects: what each is, its usual cause and what to do about it."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

from monitor.cli import output
from monitor.cli.database import check_path, opened
from monitor.cli.parser import common
from monitor.workflow.effects import effects, effects_of_campaign, effects_of_folder

EXAMPLE = "monitor effects backlash\n  monitor effects lag --folder examples/tracked-robot"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "text", nargs="?", metavar="TEXT", help="words that the effect, cause or remedy contains"
    )
    whose = parser.add_mutually_exclusive_group()
    whose.add_argument(
        "--topology", default="w C B X b Z Y (C1) t", help="the machine (default: 'w C B X b Z Y (C1) t')"
    )
    whose.add_argument(
        "--folder", metavar="FOLDER", help="what explain looks for in this campaign folder, robots too"
    )
    whose.add_argument(
        "--campaign", metavar="CAMPAIGN", help="what explain looks for in this campaign of the database"
    )


def _found(options: Namespace) -> dict[str, Any]:
    if options.folder is not None:
        return effects_of_folder(Path(options.folder), options.text)
    if options.campaign is not None:
        check_path(options.db, may_be_new=False)
        with opened(options) as db:
            return effects_of_campaign(db, options.campaign, options.text)
    return effects(options.topology, options.text)


def run(options: Namespace) -> int:
    found = _found(options)
    if options.json:
        output.document(found)
        return 0
    if not found["effects"]:
        output.say(
            f"no effect says '{options.text}'; try another word, such as backlash, thermal, worm or guideway"
        )
        return 0
    rows = [[one["effect"], one["unit"], one["meaning"], one["cause"]] for one in found["effects"]]
    whose = found["campaign"] if "campaign" in found else found["topology"]
    output.table(
        f"{len(rows)} effects of {whose}",
        ["effect", "unit", "what it is", "usual cause"],
        rows,
        text_columns=4,
    )
    return 0
