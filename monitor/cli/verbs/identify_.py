"""Identify the geometric errors of every run and store them. Without a campaign, of all campaigns."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from monitor.cli import identify_output, output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.exceptions import InputError
from monitor.workflow.identify.answer import IdentificationsAnswer
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest, StepwiseRequest
from monitor.workflow.identify.stepwise import identify_stepwise
from monitor.workflow.intake import campaigns

EXAMPLE = "monitor identify five-days"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("campaign", nargs="?", metavar="CAMPAIGN")
    parser.add_argument(
        "--model",
        metavar="NAME",
        help="a model, or a version of it: NAME@2 (default: that of the campaign's method)",
    )
    parser.add_argument("--run", type=int, metavar="N", dest="number", help="this run alone")
    parser.add_argument(
        "--stepwise",
        action="store_true",
        help="for l-shape: one run step by step as well, beside the fit of all at once, and why they differ",
    )


def run(options: Namespace) -> int:
    if options.stepwise:
        return _stepwise(options)
    with opened(options) as db, output.working("identifying"), db.transaction():
        answers = [
            identify(db, IdentifyRequest(campaign, options.model, options.number))
            for campaign in campaigns.selected_campaigns(db, options.campaign)
        ]
    if options.json:
        output.document(answers[0] if options.campaign is not None else IdentificationsAnswer(tuple(answers)))
        return 0
    for answer in answers:
        identify_output.show(answer)
    return 0


def _stepwise(options: Namespace) -> int:
    if options.campaign is None:
        raise InputError("--stepwise shows one run: name its campaign")
    with opened(options) as db, output.working("identifying step by step"):
        answer = identify_stepwise(db, StepwiseRequest(options.campaign, options.model, options.number))
    if options.json:
        output.document(answer)
    else:
        identify_output.stepwise(answer)
    return 0
