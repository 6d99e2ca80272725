"""Search the catalogue of effects: what each is, its usual cause and what to do about it."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import ask, check_path, opened
from monitor.cli.parser import common
from monitor.cli.screen import on_screen
from monitor.workflow.effects import (
    DEFAULT_TOPOLOGY,
    CampaignEffectsRequest,
    EffectsAnswer,
    EffectsRequest,
    campaign_effects,
    effects,
)

EXAMPLE = "monitor effects backlash\n  monitor effects lag --folder examples/tracked-robot"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "text", nargs="?", metavar="TEXT", help="words that the effect, cause or remedy contains"
    )
    whose = parser.add_mutually_exclusive_group()
    whose.add_argument(
        "--topology", default=DEFAULT_TOPOLOGY, help=f"the machine (default: '{DEFAULT_TOPOLOGY}')"
    )
    whose.add_argument(
        "--folder", metavar="FOLDER", help="what explain looks for in this campaign folder, robots too"
    )
    whose.add_argument(
        "--campaign", metavar="CAMPAIGN", help="what explain looks for in this campaign of the database"
    )


def _answer(options: Namespace) -> EffectsAnswer:
    if options.campaign is not None:
        check_path(options.db, may_be_new=options.server is not None)
        with opened(options) as db:
            return ask(db, campaign_effects, CampaignEffectsRequest(options.campaign, options.text))
    if options.folder is not None:
        return effects(EffectsRequest(folder=Path(options.folder), text=options.text))
    return effects(EffectsRequest(topology=options.topology, text=options.text))


def run(options: Namespace) -> int:
    answer = _answer(options)
    if options.json:
        output.document(answer)
        return 0
    answer = on_screen(answer)
    if not answer.effects:
        hint = f"did you mean '{answer.nearest}'? Else " if answer.nearest else ""
        output.say(
            f"no effect says '{options.text}'; {hint}try another word, such as backlash, thermal, worm or guideway"
        )
        return 0
    rows = [
        [effect.effect, effect.unit, effect.description.meaning, effect.description.cause]
        for effect in answer.effects
    ]
    output.table(
        f"{len(rows)} effects of {answer.campaign or answer.topology}",
        ["effect", "unit", "what it is", "usual cause"],
        rows,
        text_columns=4,
    )
    return 0
