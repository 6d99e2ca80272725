"""Find which physical effect is missing, with cause and remedy; or say that nothing is, or that data cannot decide."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

from monitor.cli import curve_output, output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.cli.verbs.compare_ import summary
from monitor.store import is_curve
from monitor.workflow.explain.comparison import explain_campaign, fitted

EXAMPLE = "monitor explain hidden-spindle-growth --figures figures"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("campaign", metavar="CAMPAIGN")
    parser.add_argument("--model", metavar="NAME")
    parser.add_argument(
        "--rate", type=float, default=0.01, metavar="Q", help="false discovery rate (default 0.01)"
    )
    parser.add_argument(
        "--figures", type=Path, metavar="DIR", help="draw what is missing and how the error falls"
    )


def run(options: Namespace) -> int:
    # One transaction: figures that cannot be drawn leave no result behind.
    with opened(options) as db, output.working("searching"), db.transaction():
        if is_curve(db, options.campaign):
            return curve_output.explain(db, options)
        found, explanation = explain_campaign(db, options.campaign, options.model, options.rate)
        if options.figures is not None:
            from monitor.workflow.explain.figures import comparison_figures, explanation_figures

            # Where the model fails as it is; the fit of the explanation has the missing effects already.
            as_it_is = fitted(db, options.campaign, options.model)[2]
            found["figures"] = comparison_figures(found, as_it_is, options.figures)
            more = explanation_figures(found, explanation, options.figures)
            # The residual over the workspace belongs to both.
            found["figures"] = list(dict.fromkeys([*found["figures"], *more]))
    if options.json:
        output.document(found)
        return 0
    if found["likely_mistakes"]:
        output.say(found["answer"])
        summary(found)
        return 0
    summary(found)
    output.say()
    for one in found["missing"]:
        _effect(one, found)
    for point in found["suspect_data"]:
        output.say(
            f"bad point: run {point['run']}, sequence {point['sequence']}, {found['target_word']} {point['target']}: "
            f"{point['axis']} is off by {point['size_um']:.1f} µm; it was left out"
        )
    output.say(found["answer"])
    if found["missing"]:
        output.say(
            f'to add it: monitor model add "{found["missing"][0]["effect"]}" --to {found["model"]} --as NAME'
        )
    for sentence in found["undecided"]:
        output.say(sentence)
    if found["blind_spots"]:
        output.say(
            f"blind spots of this plan: {len(found['blind_spots'])} effects leave nothing to see "
            f"({', '.join(found['blind_spots'][:6])}, ...); --json lists them"
        )
    for file in found.get("figures", []):
        output.say(file)
    return 0


def _effect(one: dict[str, Any], found: dict[str, Any]) -> None:
    where = "tip" if found["target_word"] == "ball" else f"{found['target_word']}s"
    output.say(f"{one['rank']}. {one['effect']}: {one['meaning']}")
    output.say(
        f"   {output.rounded(one['amplitude'], one['u'])} ± {output.two_digits(one['u'])} {one['unit']}, at most "
        f"{one['peak_um']:.1f} µm at the {where}; {output.stated('p', one['p_value'])}, "
        f"{output.stated('q', one['q_value'])}"
    )
    if "searched" in one:
        sought = one["searched"]
        u = "" if sought["u"] is None else f" ± {output.two_digits(sought['u'])}"
        unit = "" if sought["unit"] == "1" else f" {sought['unit']}"
        output.say(f"   {sought['what']} {output.rounded(sought['value'], sought['u'])}{u}{unit}")
    output.say(
        f"   RMS {output.micrometres(one['rms_before_um'])} -> {output.micrometres(one['rms_after_um'])} µm; "
        f"on held-out {found['held_out']} {output.micrometres(one['heldout_before_um'])} -> "
        f"{output.micrometres(one['heldout_after_um'])} µm"
    )
    output.say(f"   cause: {one['cause']}")
    output.say(f"   remedy: {one['remedy']}")
    if one["indistinguishable_from"]:
        output.say(f"   these data do not rule out: {', '.join(one['indistinguishable_from'])}")
        if one["tell_apart_by"]:
            poses = "; ".join(
                ", ".join(f"{axis[:-4]} {value:g}°" for axis, value in pose.items())
                for pose in one["tell_apart_by"]
            )
            output.say(f"   to tell them apart, probe also at {poses}")
