"""Expected uncertainties of a plan before anyone measures, its blind spots, and the best balls and indexations."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.cli.verbs import plan_angles
from monitor.exceptions import InputError
from monitor.workflow.plan.planning import plan, plan_figure

EXAMPLE = "monitor plan five-days --balls 4 --poses 10 --separate EBZ:poly2,EZZ:poly2"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("campaign", metavar="CAMPAIGN", help="whose machine, artefact and plan are the start")
    parser.add_argument("--model", metavar="NAME")
    parser.add_argument(
        "--balls", type=int, metavar="N", help="the best N balls (1 to 24; places for more are proposed)"
    )
    parser.add_argument(
        "--poses",
        type=int,
        metavar="N",
        help="the best N indexations (free-form: the next N angles of the table)",
    )
    parser.add_argument(
        "--wanted", action="append", default=[], metavar="PARAMETER=U",
        help="a standard uncertainty in display units; the quickest plan that reaches all; may be repeated",
    )  # fmt: skip
    parser.add_argument("--separate", metavar="EFFECT,EFFECT", help="poses that tell two effects apart")
    parser.add_argument("--figures", type=Path, metavar="DIR", help="draw the expected uncertainties")


def _wanted(texts: list[str]) -> dict[str, float]:
    found = {}
    for text in texts:
        name, _, number = text.partition("=")
        try:
            found[name] = float(number)
        except ValueError:
            raise InputError(
                f"--wanted {text}: write a parameter, = and a number, for example EA0C=2.5"
            ) from None
    return found


def _separate(text: str | None) -> tuple[str, str] | None:
    """Two effects; a comma inside brackets belongs to a formula."""
    if text is None:
        return None
    parts, depth = [""], 0
    for letter in text:
        depth += {"(": 1, ")": -1}.get(letter, 0)
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    if len(parts) != 2 or not all(part.strip() for part in parts):
        raise InputError(f"--separate {text}: name two effects with a comma, for example EBZ:poly2,EZZ:poly2")
    return parts[0].strip(), parts[1].strip()


def run(options: Namespace) -> int:
    wanted, separate = _wanted(options.wanted), _separate(options.separate)
    # One transaction: files that cannot be written leave no result behind.
    with opened(options) as db, output.working("planning"), db.transaction():
        found = plan(
            db, options.campaign, model=options.model, balls=options.balls, poses=options.poses, wanted=wanted,
            separate=separate,
        )  # fmt: skip
        if options.figures is not None and "angles" in found:
            raise InputError("--figures: a plan of table angles has no figure yet; leave it out")
        if options.figures is not None:
            found["figures"] = plan_figure(found, options.figures)
    if options.json:
        output.document(found)
        return 0
    if "angles" in found:
        plan_angles.tables(found)
        return 0
    _tables(found)
    if "separate" in found:
        one = found["separate"]
        output.say(f"{' and '.join(one['effects'])}: {one['verdict']}")
        for pose in one["poses"]:
            output.say(f"   {_pose(pose)}")
    for file in found.get("figures", []):
        output.say(file)
    return 0


def _tables(found: dict[str, Any]) -> None:
    present, proposed = found["present"], found.get("proposed")
    output.say(f"{found['campaign']}: {_size(present)}")
    if proposed:
        output.say(f"proposed: {_size(proposed)}")
    columns = ["parameter", "unit", "u", "separation"]
    columns += ["u proposed", "separation", "merit"] if proposed else []
    rows = []
    for name, one in present["parameters"].items():
        row = [name, one["unit"], _u(one["u"]), f"{one['separation']:.2f}"]
        if proposed:
            other = proposed["parameters"][name]
            merit = other["figure_of_merit"]
            row += [_u(other["u"]), f"{other['separation']:.2f}", "-" if merit is None else f"{merit:.2f}"]
        rows.append(row)
    stated = found["stated_uncertainty_um"]
    output.table(
        f"expected standard uncertainties of one run, {stated:g} µm a coordinate",
        columns,
        rows,
        text_columns=2,
    )
    if proposed:
        output.say(
            "merit: what an hour of the proposed plan tells of the parameter, against the present plan"
        )
    for name in (proposed or present)["refused"]:
        output.say(f"no number: this plan does not determine {name}")
    time = found["time_model"]
    output.say(
        f"time: {time['seconds_a_probing']:.0f} s a probing and {time['seconds_an_indexation']:.0f} s more for another "
        f"indexation ({time['from']})"
    )
    if proposed:
        output.say(
            "indexations (whether the stylus gets there unhindered, only a look at the machine tells):"
        )
        for pose in proposed["poses"]:
            output.say(f"   {_pose(pose)}")
        new = {name: place for name, place in proposed["ball_places_mm"].items() if name.startswith("new ")}
        for name, place in new.items():
            output.say(f"   ball {name} at {', '.join(f'{value:.0f}' for value in place)} mm")
    blind = (proposed or found)["blind_spots"]
    output.say(
        f"blind spots: {len(blind)} effects leave nothing to see ({', '.join(blind[:6])}, ...); --json lists them"
    )


def _size(plan: dict[str, Any]) -> str:
    return (
        f"{len(plan['balls'])} balls ({', '.join(plan['balls'])}) at {len(plan['poses'])} indexations, "
        f"{plan['probings']} probings in {plan['seconds'] / 60.0:.0f} min"
    )


def _u(value: float | None) -> str:
    return "none" if value is None else f"{value:.2g}"


def _pose(pose: dict[str, float]) -> str:
    return ", ".join(f"{axis[:-4].upper()} {value:g}°" for axis, value in pose.items())
