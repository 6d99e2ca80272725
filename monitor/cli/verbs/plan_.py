"""Expected uncertainties of a plan before anyone measures, its blind spots, and the best balls and indexations."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import add_model, common
from monitor.cli.residual_output import files
from monitor.cli.screen import on_screen
from monitor.cli.verbs import plan_angles, plan_instruments
from monitor.exceptions import InputError
from monitor.workflow.plan.answer import (
    AnglePlanAnswer,
    BallPlan,
    BallPlanAnswer,
    InstrumentPlanAnswer,
    PlannedParameter,
    Pose,
)
from monitor.workflow.plan.plan import plan
from monitor.workflow.plan.request import PlanRequest

EXAMPLE = "monitor plan five-days --balls 4 --poses 10 --separate EBZ:poly2,EZZ:poly2"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("campaign", metavar="CAMPAIGN", help="whose machine, artefact and plan are the start")
    add_model(parser)
    parser.add_argument(
        "--balls", type=int, metavar="N", help="the best N balls (1 to 24; places for more are proposed)"
    )
    parser.add_argument(
        "--poses",
        type=int,
        metavar="N",
        help="the best N indexations (free-form: the next N angles of the table; instruments: the next N tests)",
    )
    parser.add_argument(
        "--for", action="append", default=[], metavar="PARAMETER", dest="parameters",
        help="of instruments: the parameter for which the next test is sought (default: all); may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--wanted", action="append", default=[], metavar="PARAMETER=U",
        help="a standard uncertainty in µm, µrad or µm/m; the quickest plan that reaches all; may be repeated",
    )  # fmt: skip
    parser.add_argument("--separate", metavar="EFFECT,EFFECT", help="poses that tell two effects apart")
    parser.add_argument("--figures", type=Path, metavar="DIR", help="draw the expected uncertainties")


def _wanted(texts: list[str]) -> dict[str, float]:
    wanted = {}
    for text in texts:
        name, _, number = text.partition("=")
        try:
            wanted[name] = float(number)
        except ValueError:
            raise InputError(
                f"--wanted {text}: write a parameter, = and a number, for example EA0C=2.5"
            ) from None
    return wanted


def run(options: Namespace) -> int:
    request = PlanRequest(
        options.campaign, options.model, options.balls, options.poses, _wanted(options.wanted),
        None if options.separate is None else PlanRequest.two_effects(options.separate), figures=options.figures,
        parameters=tuple(options.parameters),
    )  # fmt: skip
    # One transaction: files that cannot be written leave no result behind.
    with opened(options) as db, output.working("planning"):
        answer = ask(db, plan, request)
    if options.json:
        output.document(answer)
    elif isinstance(answer, AnglePlanAnswer):
        plan_angles.tables(on_screen(answer))
    elif isinstance(answer, InstrumentPlanAnswer):
        plan_instruments.tables(on_screen(answer))
    else:
        _tables(on_screen(answer))
    return 0


def _tables(answer: BallPlanAnswer) -> None:
    proposed = answer.proposed
    output.say(f"{answer.campaign}: {_size(answer.present)}")
    if proposed is not None:
        output.say(f"proposed: {_size(proposed)}")
    _parameters(answer)
    time = answer.time_model
    output.say(
        f"time: {time.seconds_a_probing:.0f} s a probing and {time.seconds_an_indexation:.0f} s more for another "
        f"indexation ({time.source})"
    )
    if proposed is not None:
        _indexations(proposed.poses, answer.new_balls)
    blind = answer.blind_spots if proposed is None else proposed.blind_spots or ()
    output.say(
        f"blind spots: {len(blind)} effects leave nothing to see ({', '.join(blind[:6])}, ...); --json lists them"
    )
    if answer.separate is not None:
        output.say(f"{' and '.join(answer.separate.effects)}: {answer.separate.verdict.value}")
        for pose in answer.separate.poses:
            output.say(f"   {_pose(pose)}")
    files(answer.figures)


def _parameters(answer: BallPlanAnswer) -> None:
    """What the present plan promises of every parameter, and the proposed one beside it."""
    proposed = answer.proposed
    columns = ["parameter", "unit", "u", "separation"]
    rows = [
        [name, parameter.unit, _uncertainty(parameter.u), f"{parameter.separation:.2f}"]
        for name, parameter in answer.present.parameters.items()
    ]
    if proposed is not None:
        columns += ["u proposed", "separation", "merit"]
        for row in rows:
            row += _proposed_cells(proposed.parameters[row[0]])
    output.table(
        f"expected standard uncertainties of one run, {answer.stated_uncertainty_um:g} µm a coordinate",
        columns,
        rows,
        text_columns=2,
    )
    if proposed is not None:
        output.say(
            "merit: information on the parameter in an hour of the proposed plan, relative to the present plan"
        )
    for name in (proposed or answer.present).refused:
        output.say(f"no number: this plan does not determine {name}")


def _proposed_cells(parameter: PlannedParameter) -> list[str]:
    merit = parameter.figure_of_merit
    return [
        _uncertainty(parameter.u),
        f"{parameter.separation:.2f}",
        "-" if merit is None else f"{merit:.2f}",
    ]


def _indexations(poses: Sequence[Pose], new_balls: Mapping[str, Sequence[float]]) -> None:
    """Where the proposed plan probes, and where its new balls stand."""
    output.say("indexations (check on the machine that the stylus can reach them):")
    for pose in poses:
        output.say(f"   {_pose(pose)}")
    for name, position in new_balls.items():
        output.say(f"   ball {name} at {', '.join(f'{value:.0f}' for value in position)} mm")


def _size(plan: BallPlan) -> str:
    return (
        f"{len(plan.balls)} balls ({', '.join(plan.balls)}) at {len(plan.poses)} indexations, "
        f"{plan.probings} probings in {plan.seconds / 60.0:.0f} min"
    )


def _uncertainty(value: float | None) -> str:
    return "none" if value is None else f"{value:.2g}"


def _pose(pose: Pose) -> str:
    return ", ".join(f"{axis[:-4].upper()} {value:g}°" for axis, value in pose.items())
