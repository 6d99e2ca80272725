"""Identify the geometric errors of every run and store them. Without a campaign, of all campaigns."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import Any

from monitor.cli import curve_output, output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.exceptions import InputError
from monitor.store import is_curve
from monitor.workflow.explain import curves
from monitor.workflow.identify.identification import identify
from monitor.workflow.identify.stepwise import steps
from monitor.workflow.intake import campaigns

EXAMPLE = "monitor identify five-days"
# A screen holds so many runs beside the names of the parameters.
SHOWN_RUNS = 6


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
        names = campaigns.chosen(db, options.campaign)
        found = [
            (curves.identify if is_curve(db, name) else identify)(db, name, options.model, options.number)
            for name in names
        ]
    if options.json:
        output.document(found[0] if options.campaign is not None else {"identifications": found})
        return 0
    for one in found:
        show(one)
    return 0


def _stepwise(options: Namespace) -> int:
    if options.campaign is None:
        raise InputError("--stepwise shows one run: name its campaign")
    with opened(options) as db, output.working("identifying step by step"):
        found = steps(db, options.campaign, options.model, options.number)
    if options.json:
        output.document(found)
        return 0
    rows = []
    for name, one in found["stepwise"].items():
        once = one["at_once"]
        rows.append(
            [
                name,
                one["unit"],
                output.rounded(one["stepwise"], one["u_stepwise"]),
                output.two_digits(one["u_stepwise"]),
                "-" if once is None else output.rounded(once, one["u_at_once"]),
                "-" if once is None else output.two_digits(one["u_at_once"]),
                "-" if once is None else output.rounded(one["difference_by_method"], one["u_stepwise"]),
                "" if one["agrees"] else "differs",
                one["why"],
            ]
        )
    output.table(
        f"{found['campaign']}, run {found['run']}: step by step and all at once",
        ["parameter", "unit", "stepwise", "u", "at once", "u", "by method", "", "what tells them apart"],
        rows,
        text_columns=2,
    )
    output.say(
        "by method: what of the difference remains without noise; 'differs': the rest exceeds 2 u of it"
    )
    return 0


def show(found: dict[str, Any]) -> None:
    """The parameters of the runs, newest last, and what was refused."""
    if "response" in found:
        curve_output.coefficients(found)
        return
    runs = found["runs"][-SHOWN_RUNS:]
    names = list(dict.fromkeys(name for one in runs for name in one["parameters"]))
    rows = []
    for name in names:
        cells = [one["parameters"].get(name) for one in runs]
        unit = next(cell["unit"] for cell in cells if cell)
        last = next(cell for cell in reversed(cells) if cell)
        values = ["-" if cell is None else output.rounded(cell["value"], cell["u"]) for cell in cells]
        rows.append([name, unit, *values, output.two_digits(last["u"])])
    rows.append(["RMS", "µm", *(f"{one['rms_um']:.2f}" for one in runs), ""])
    left_out = len(found["runs"]) - len(runs)
    before = f" (the last {len(runs)} of {len(found['runs'])} runs; --json has all)" if left_out else ""
    output.table(
        f"{found['campaign']}, model {found['model']}{before}",
        ["parameter", "unit", *(f"run {one['run']}" for one in runs), "u"],
        rows,
        text_columns=2,
    )
    notes = [one["note"] for one in runs if one["note"]]
    if notes:
        output.say(notes[0] + (f" (and {len(notes) - 1} more of these runs)" if len(notes) > 1 else ""))
    for why in dict.fromkeys(refusal["why"] for one in found["runs"] for refusal in one["refused"]):
        output.say(f"no number: {why}")
    for name, value in found["added"].items():
        output.say(
            f"{name}: {output.rounded(value['value'], value['u'])} ± {output.two_digits(value['u'])} "
            f"{value['unit']} in all runs"
        )
    for refusal in found["added_refused"]:
        output.say(f"no number: {', '.join(refusal['parameters'])}: {refusal['why']}")
