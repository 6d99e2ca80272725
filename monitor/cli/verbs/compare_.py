"""Compare a model with the measurements and show where it fails."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from pathlib import Path

from monitor.cli import output, residual_output
from monitor.cli.contradiction_output import against_others, chance, likely_mistakes
from monitor.cli.database import ask, opened
from monitor.cli.parser import add_model, common
from monitor.records import Verdict
from monitor.reporting.machine_finding import LARGER, TOGETHER
from monitor.workflow.explain.compare import compare
from monitor.workflow.explain.compare_answer import (
    CompareAnswer,
    CurveComparison,
    MachineComparison,
    MachinePart,
)
from monitor.workflow.explain.request import CompareRequest
from monitor.workflow.instruments.answer import Disagreement, RunsWithTime

# The calibrated bar leaves its balls, touched once a run, a residual of some nanometres.
NOTHING_CHECKS_UM = 0.005
# A robot has a thousand indexations; more than these are no table to read.
MOST_PARTS = 20
#: The breakdowns of a machine that are shown, and those that are cut to the worst parts.
SHOWN, CUT = ("axis", "target", "indexation", "run"), ("target", "indexation")
EXAMPLE = "monitor compare hidden-reversal-x --figures figures"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument(
        "campaign", metavar="CAMPAIGN", help="a campaign of the database (monitor campaigns lists them)"
    )
    add_model(parser)
    parser.add_argument("--figures", type=Path, metavar="DIR", help="draw where the model fails")


def run(options: Namespace) -> int:
    request = CompareRequest(options.campaign, options.model, options.figures)
    # One transaction: figures that cannot be drawn leave no result behind.
    with opened(options) as db, output.working("comparing"):
        answer = ask(db, compare, request)
    if options.json:
        output.document(answer)
        return 0
    output.copied(answer.copied_readings)
    if answer.work_points_elsewhere is not None:
        output.say(str(answer.work_points_elsewhere))
    residual_output.summary(answer.comparison)
    if isinstance(answer.comparison, MachineComparison) and answer.comparison.verdict is Verdict.EXPLAINED:
        output.say(TOGETHER.format(campaign=answer.comparison.campaign))
        if answer.comparison.exceeds_statement:
            output.say(LARGER.format(p=output.stated("p", answer.comparison.excess_over_statement_p)))
    if answer.instruments_disagree is not None:
        _disagreement(answer.comparison.campaign, answer.instruments_disagree)
    if answer.against_others is not None:
        against_others(answer.against_others)
    likely_mistakes(answer.likely_mistakes)
    for drift in answer.run_with_time or ():
        _drift(answer.comparison.campaign, drift)
    _breakdown(answer)
    residual_output.files(answer.figures)
    return 0


def _drift(campaign: str, drift: RunsWithTime) -> None:
    number = f" ({drift.number})" if drift.number != "reading" else ""
    output.say(
        f"setup {drift.setup}{number} in run {drift.run} runs with the time: {drift.size:+.3g} {drift.unit} from its "
        f"first row to its last, u = {drift.u:.2g} {drift.unit}, one of {drift.comparisons} looked at; chance alone "
        f"makes one as large in {chance(drift.by_chance)} of campaigns. It drifts, or the model lacks what the plan "
        f"went through in order: `monitor explain {campaign}` weighs both; a drift belongs into u, as "
        "drift_standard_uncertainty_um or _urad of the setup"
    )


def _disagreement(campaign: str, apart: Disagreement) -> None:
    output.say(
        f"{apart.parameter} in run {apart.run}: {apart.first} and {apart.second} disagree, E_n = {apart.e_n:.2f}, the "
        f"least likely of {apart.comparisons}; chance alone makes one as large in {chance(apart.by_chance)} of "
        f"campaigns. `monitor contributions {campaign} --run {apart.run}` says what each says alone, "
        f"`monitor explain {campaign}` what may be missing"
    )


def _breakdown(answer: CompareAnswer) -> None:
    comparison = answer.comparison
    if isinstance(comparison, CurveComparison):
        number = residual_output.four_digits
        for column, parts in comparison.by.items():
            rows = [
                [name, number(part.rms), number(part.largest), str(part.n)] for name, part in parts.items()
            ]
            output.table("", [f"by {column}", f"RMS / {comparison.unit}", "largest", "rows"], rows)
        return
    for kind in SHOWN:
        if comparison.by.get(kind):
            _machine_parts(kind, comparison, answer.target_word)


def _machine_parts(kind: str, comparison: MachineComparison, target_word: str | None) -> None:
    parts: Mapping[str, MachinePart] = comparison.by[kind]
    frames = (comparison.refers_to or {}) if kind == "axis" else {}
    names = list(parts)
    cut = kind in CUT and len(names) > MOST_PARTS
    if cut:
        worst = sorted(names, key=lambda name: -parts[name].rms_um)[:MOST_PARTS]
        names = [name for name in names if name in worst]
    readings = "touches" if target_word == "ball" else "readings"
    rows = [
        [
            name,
            *([frames[name]] if frames else []),
            _checked(parts[name].rms_um),
            _checked(parts[name].largest_um),
            str(parts[name].n),
        ]
        for name in names
    ]
    head = [f"by {kind}", *(["relative to"] if frames else []), "RMS / µm", "largest / µm", readings]
    output.table("", head, rows, text_columns=len(head) - 3)
    if cut:
        output.say(f"the worst {MOST_PARTS} of {len(parts)}; --json has all")


def _checked(length: float) -> str:
    """A residual; a dash where the touches have nothing to check them (a ball touched once is followed exactly)."""
    return "-" if length < NOTHING_CHECKS_UM else output.micrometres(length)
