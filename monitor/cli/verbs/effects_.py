"""Search the catalogue of effects: what each is, its usual cause and what to do about it."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from monitor.cli import output
from monitor.cli.parser import common
from monitor.workflow.effects import effects

EXAMPLE = "monitor effects backlash"


def options(parser: ArgumentParser) -> None:
    common(parser, database=False)
    parser.add_argument(
        "text", nargs="?", metavar="TEXT", help="words that the effect, cause or remedy contains"
    )
    parser.add_argument(
        "--topology", default="w C B X b Z Y (C1) t", help="the machine (default: 'w C B X b Z Y (C1) t')"
    )


def run(options: Namespace) -> int:
    found = effects(options.topology, options.text)
    if options.json:
        output.document(found)
        return 0
    if not found["effects"]:
        output.say(
            f"no effect says '{options.text}'; try another word, such as backlash, thermal, worm or guideway"
        )
        return 0
    rows = [[one["effect"], one["unit"], one["meaning"], one["cause"]] for one in found["effects"]]
    output.table(
        f"{len(rows)} effects of {found['topology']}",
        ["effect", "unit", "what it is", "usual cause"],
        rows,
        left=4,
    )
    return 0
