"""Compare a model with the measurements and show where it fails."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path

from monitor.cli import output, residual_output
from monitor.cli.database import ask, opened
from monitor.cli.parser import add_model, common
from monitor.records import Verdict
from monitor.reporting.machine_finding import TOGETHER
from monitor.workflow.explain.compare import compare
from monitor.workflow.explain.compare_answer import (
    CompareAnswer,
    CurveComparison,
    MachineComparison,
    MachinePart,
)
from monitor.workflow.explain.request import CompareRequest
from monitor.workflow.instruments.answer import AgainstOthers, Disagreement, RunsWithTime, Suspect

# The calibrated bar leaves its balls, touched once a run, a residual of some nanometres.
NOTHING_CHECKS_UM = 0.005
# A robot has a thousand indexations; more than these are no table to read.
MOST_PARTS = 20
#: Of disagreements that chance makes more rarely no digits are shown: normal tails are not known so far out.
LEAST_PERCENT = 0.001
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
    residual_output.summary(answer.comparison)
    if isinstance(answer.comparison, MachineComparison) and answer.comparison.verdict is Verdict.EXPLAINED:
        output.say(TOGETHER.format(campaign=answer.comparison.campaign))
    if answer.instruments_disagree is not None:
        _disagreement(answer.comparison.campaign, answer.instruments_disagree)
    if answer.against_others is not None:
        _against_others(answer.against_others)
    for drift in answer.run_with_time or ():
        _drift(answer.comparison.campaign, drift)
    _breakdown(answer)
    residual_output.files(answer.figures)
    return 0


def _chance(by_chance: float) -> str:
    """How often chance does such a thing, in words."""
    percent = 100.0 * by_chance
    return f"at most {percent:.1g} %" if percent >= LEAST_PERCENT else f"less than {LEAST_PERCENT:g} %"


def _drift(campaign: str, drift: RunsWithTime) -> None:
    number = f" ({drift.number})" if drift.number != "reading" else ""
    output.say(
        f"setup {drift.setup}{number} in run {drift.run} runs with the time: {drift.size:+.3g} {drift.unit} from its "
        f"first row to its last, u = {drift.u:.2g} {drift.unit}, one of {drift.comparisons} looked at; chance alone "
        f"makes one as large in {_chance(drift.by_chance)} of campaigns. It drifts, or the model lacks what the plan "
        f"went through in order: `monitor explain {campaign}` weighs both; a drift belongs into u, as "
        "drift_standard_uncertainty_um or _urad of the setup"
    )


def _disagreement(campaign: str, apart: Disagreement) -> None:
    chance = _chance(apart.by_chance)
    output.say(
        f"{apart.parameter} in run {apart.run}: {apart.first} and {apart.second} disagree, E_n = {apart.e_n:.2f}, the "
        f"least likely of {apart.comparisons}; chance alone makes one as large in {chance} of campaigns. "
        f"`monitor contributions {campaign} --run {apart.run}` says what "
        f"each says alone, `monitor explain {campaign}` what may be missing"
    )


def _against_others(beside: AgainstOthers) -> None:
    names, suspects = " or ".join(suspect.name for suspect in beside.suspects), beside.suspects
    agree = all(suspect.others_agree for suspect in suspects)
    said = f"setups in run {beside.run} contradict each other"
    if not suspects:
        who = (
            "No single setup or instrument explains it: more than one is wrong, or the model lacks something"
        )
    elif len(suspects) == 1:
        said = f"{names} in run {beside.run} contradicts all others together"
        rest = "the others agree" if agree else "nothing is left that could contradict"
        who = (
            f"Without {names} {rest}: look first at {_where(suspects)}; where they are right, the model lacks what the "
            "others do not meet"
        )
    else:
        if beside.is_of_two:
            said = f"{suspects[0].name} and {suspects[1].name} in run {beside.run} contradict each other"
        rest = "the others agree" if agree else "nothing contradicts"
        who = f"Without {names} {rest}, so that any of these may be the wrong one: look at {_where(suspects)}"
    output.say(
        f"{said} by {beside.size:.1f} u in "
        f"{beside.directions} {'direction' if beside.directions == 1 else 'directions'}; chance alone makes as much in "
        f"{_chance(beside.by_chance)} of campaigns. {who}"
    )


def _where(suspects: Sequence[Suspect]) -> str:
    """What to look at: of a number that is stated nothing was read."""
    read = [suspect.name for suspect in suspects if not suspect.is_stated]
    parts = [f"signs, unit, points and rows of {' and '.join(read)}"] if read else []
    parts += [
        f"{suspect.name}, one number for {', '.join(suspect.setups)} (its certificate, the digits and the unit in the "
        "file, the temperature)"
        for suspect in suspects
        if suspect.is_stated
    ]
    return " and at ".join(parts)


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
