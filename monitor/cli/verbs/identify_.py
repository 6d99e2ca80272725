"""Identify and store the geometric errors of every run, with u of independent readings. Without a campaign, of all."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import add_model, common
from monitor.cli.screen import on_screen
from monitor.exceptions import InputError
from monitor.workflow.identify.request import IdentifyRequest, StepwiseRequest

EXAMPLE = "monitor identify five-days"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "campaign", nargs="?", metavar="CAMPAIGN", help="a campaign of the database (default: all)"
    )
    add_model(parser)
    parser.add_argument("--run", type=int, metavar="N", dest="number", help="this run alone")
    parser.add_argument(
        "--stepwise",
        action="store_true",
        help="for l-shape: one run step by step as well, beside the fit of all at once, and why they differ",
    )
    parser.add_argument(
        "--workers",
        type=int,
        metavar="N",
        help="without a campaign: processes that identify (default: this one)",
    )
    parser.add_argument(
        "--cluster", metavar="ADDRESS", help="without a campaign: a Dask cluster, such as tcp://host:8786"
    )


def run(options: Namespace) -> int:
    if options.campaign is None and not options.stepwise:
        return _all(options)
    if options.workers is not None or options.cluster is not None:
        raise InputError(
            "--workers and --cluster spread many campaigns: leave the campaign out to identify all"
        )
    if options.stepwise:
        return _stepwise(options)
    # Loaded here, as below: --help solves nothing, and the solvers take most of a second.
    from monitor.cli import identify_output
    from monitor.workflow.identify.identify import identify

    with opened(options) as db, output.working("identifying"):
        answer = ask(db, identify, IdentifyRequest(options.campaign, options.model, options.number))
    if options.json:
        output.document(answer)
    else:
        identify_output.show(on_screen(answer))
    return 0


def _all(options: Namespace) -> int:
    """Identify every campaign; exit status 2 where one could not be."""
    if options.number is not None:
        raise InputError(f"--run {options.number} is a run of one campaign: name it")
    from monitor.cli import identify_output
    from monitor.workflow.identify.every import IdentifyAllRequest, identify_all
    from monitor.workflow.intake.campaigns import campaigns

    request = IdentifyAllRequest(options.model, options.workers, options.cluster)
    with opened(options) as db:
        total = len(ask(db, campaigns).campaigns)
        with output.stepping("identifying", total, behind=True) as progress:
            answer = ask(db, identify_all, request, progress=progress)
    if options.json:
        output.document(answer)
    else:
        for identification in answer.identifications:
            identify_output.show(on_screen(identification))
    for refused in answer.refused:
        print(f"monitor: {refused.campaign}: {refused.why}", file=sys.stderr)
    return 2 if answer.refused else 0


def _stepwise(options: Namespace) -> int:
    if options.campaign is None:
        raise InputError("--stepwise shows one run: name its campaign")
    from monitor.cli import identify_output
    from monitor.workflow.identify.stepwise import identify_stepwise

    with opened(options) as db, output.working("identifying step by step"):
        answer = ask(db, identify_stepwise, StepwiseRequest(options.campaign, options.model, options.number))
    if options.json:
        output.document(answer)
    else:
        identify_output.stepwise(on_screen(answer))
    return 0
