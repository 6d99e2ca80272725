"""Compare a model with the measurements and show where it fails."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

from monitor.cli import curve_output, output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.store import is_curve
from monitor.workflow.explain.comparison import compare

# The calibrated bar leaves its balls, touched once a run, a residual of some nanometres.
NOTHING_CHECKS_UM = 0.005
# A robot has a thousand indexations; more than these are no table to read.
MOST_PARTS = 20
EXAMPLE = "monitor compare hidden-reversal-x --figures figures"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("campaign", metavar="CAMPAIGN")
    parser.add_argument("--model", metavar="NAME")
    parser.add_argument("--figures", type=Path, metavar="DIR", help="draw where the model fails")


def run(options: Namespace) -> int:
    # One transaction: figures that cannot be drawn leave no result behind.
    with opened(options) as db, output.working("comparing"), db.transaction():
        if is_curve(db, options.campaign):
            return curve_output.compare(db, options)
        found, fitted = compare(db, options.campaign, options.model)
        if options.figures is not None:
            from monitor.workflow.explain.figures import comparison_figures

            found["figures"] = comparison_figures(found, fitted, options.figures)
    if options.json:
        output.document(found)
        return 0
    summary(found)
    for kind in ("axis", "target", "indexation", "run"):
        parts = found["by"].get(kind, {})
        rows = [
            [name, *(_checked(part[which]) for which in ("rms_um", "largest_um")), str(part["n"])]
            for name, part in parts.items()
        ]
        left_out = (
            len(rows) - MOST_PARTS if len(rows) > MOST_PARTS and kind in ("target", "indexation") else 0
        )
        if left_out:
            worst = sorted(parts, key=lambda name: -float(parts[name]["rms_um"]))[:MOST_PARTS]
            rows = [row for row in rows if row[0] in worst]
        what = "touches" if found["target_word"] == "ball" else "readings"
        if rows:
            output.table("", [f"by {kind}", "RMS / µm", "largest / µm", what], rows)
        if left_out:
            output.say(f"the worst {MOST_PARTS} of {len(parts)}; --json has all")
    for file in found.get("figures", []):
        output.say(file)
    return 0


def _checked(length: float) -> str:
    """A residual; a dash where the touches have nothing to check them (a ball touched once is followed exactly)."""
    return "-" if length < NOTHING_CHECKS_UM else output.micrometres(length)


def summary(found: dict[str, Any]) -> None:
    """The comparison in three sentences."""
    test = found["lack_of_fit"]
    output.say(
        f"{found['campaign']}, model {found['model']}: RMS {output.micrometres(found['rms_um'])} µm, expected "
        f"{output.micrometres(found['expected_rms_um'])} µm from the probe's stated uncertainty; "
        f"repeatability {output.micrometres(found['repeatability_um'])} µm"
    )
    if test["f"] is not None:
        output.say(f"lack of fit over repeatability: F = {test['f']:.2f}, {output.stated('p', test['p'])}")
    output.say(f"verdict: {found['verdict']}")
