"""Predict rows that took no part in a fit."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from monitor.cli import output, residual_output
from monitor.cli.database import ask, opened
from monitor.cli.parser import add_model, common
from monitor.workflow.predict.predict import predict
from monitor.workflow.predict.request import PredictRequest

EXAMPLE = "monitor predict tracked-robot --model tracker"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "campaign", metavar="CAMPAIGN", help="a campaign of the database (monitor campaigns lists them)"
    )
    add_model(parser)
    parser.add_argument(
        "--of",
        metavar="CAMPAIGN",
        help="rows of this campaign, of the same set-up (default: ten parts of CAMPAIGN, each from the others)",
    )


def run(options: Namespace) -> int:
    with opened(options) as db, output.working("predicting"):
        answer = ask(db, predict, PredictRequest(options.campaign, options.model, options.of))
    if options.json:
        output.document(answer)
        return 0
    how = f"{answer.blocks} parts, each from the others" if answer.blocks > 1 else f"from {answer.campaign}"
    output.say(f"{answer.of} predicted by {answer.model} ({how}): RMS {output.micrometres(answer.rms_um)} µm")
    output.say(
        f"fitted rows {output.micrometres(answer.fitted_rms_um)} µm, stated uncertainty of a reading "
        f"{output.micrometres(answer.stated_uncertainty_um)} µm"
    )
    if answer.are_angles:
        output.say(residual_output.ANGLES)
    if answer.resting_rms_um is not None:
        output.say(f"targets beside the machine: RMS {output.micrometres(answer.resting_rms_um)} µm")
    if answer.taken_over:
        output.say(
            f"{', '.join(answer.taken_over)}: of another size in every run, so that of {answer.campaign} says nothing "
            f"of {answer.of}; it was taken over"
        )
    if answer.from_own_start:
        output.say(
            f"{', '.join(answer.from_own_start)}: counted from the start of {answer.of}, as in {answer.campaign}; what "
            "went before a start is in no reading"
        )
    rows = [
        [name, output.micrometres(part.rms_um), output.micrometres(part.largest_um), str(part.n)]
        for name, part in answer.by_target.items()
    ]
    output.table("", ["by target", "RMS / µm", "largest / µm", "readings"], rows)
    return 0
