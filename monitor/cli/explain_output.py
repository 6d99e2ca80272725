"""What `monitor explain` prints: the comparison, the missing effects, bad readings, and the finding in sentences."""

from __future__ import annotations

from collections.abc import Sequence

from monitor.cli import output, residual_output
from monitor.cli.contradiction_output import against_others
from monitor.cli.identify_output import reversal_words
from monitor.cli.measurement_output import where
from monitor.cli.residual_output import four_digits, with_uncertainty
from monitor.reporting.adjusting import remedy_holds_for
from monitor.reporting.runs_that_tell import (
    MOVED_ONCE,
    NO_POSE_TELLS,
    ONE_LINE,
    WHO_MOVED,
    further_runs,
    more_runs,
    poses_that_tell,
    positions_that_tell,
    runs_in_reversed_order,
    runs_that_tell,
)
from monitor.reporting.second_setup import IN_WORDS
from monitor.reporting.step_words import step_in_words
from monitor.workflow.explain.explain_answer import (
    BadProbing,
    BadRow,
    CurveExplanation,
    CurveMissing,
    ExplainAnswer,
    InstrumentAlias,
    MachineExplanation,
    MachineMissing,
    SearchedValue,
)
from monitor.workflow.explain.ties import Tie, TieBreak
from monitor.workflow.plan.test_answer import TestAnswer

#: So many blind spots are named.
NAMED_BLIND_SPOTS = 6


def show(answer: ExplainAnswer) -> None:
    """Print an explanation: the finding in sentences first, because whoever reads one line has to read that."""
    explanation = answer.explanation
    output.copied(answer.copied_readings)
    output.say(explanation.answer)
    residual_output.summary(explanation.comparison)
    if isinstance(explanation, MachineExplanation):
        _machine(explanation)
    else:
        _curve(explanation)
    residual_output.files(answer.figures)


def _machine(explanation: MachineExplanation) -> None:
    if explanation.likely_mistakes:
        return
    _remaining(explanation)
    output.say()
    if explanation.against_others is not None:
        against_others(explanation.against_others)
    for effect in explanation.missing:
        _machine_effect(effect, explanation)
        _advice(effect, "data", explanation.comparison.campaign)
    for reading in explanation.suspect_data:
        _bad_probing(reading, explanation.target_word)
    for reading in explanation.recurring_data:
        _recurring_probing(reading, explanation.target_word)
    _next_step(explanation)
    for alias in explanation.taken_for_machine:
        output.say(_alias(alias, explanation.comparison.campaign))
    for sentence in explanation.undecided:
        output.say(sentence)
    if explanation.blind_spots:
        names = ", ".join(explanation.blind_spots[:NAMED_BLIND_SPOTS])
        output.say(
            f"blind spots of this plan: {len(explanation.blind_spots)} effects leave nothing to see "
            f"({names}, ...); --json lists them"
        )


def _alias(alias: InstrumentAlias, campaign: str) -> str:
    """Errors of instruments that nobody could tell from the machine's, and what would."""
    effects, parameters = " or ".join(alias.effects), ", ".join(alias.parameters)
    if alias.measurement is not None:
        would = f"{_test(alias.measurement)} would tell"
    elif alias.searched:
        would = "no single further test tells"
    else:
        would = f'what would tell: monitor plan {campaign} --for "{alias.effects[0]}"'
    return f"{effects} would be read as {parameters}: {would}"


def _test(test: TestAnswer) -> str:
    """A test as one reads it: its instrument, its poses."""
    return f"{test.instrument} ({where(test)})"


def _remaining(explanation: MachineExplanation) -> None:
    """What is left with all findings in the model."""
    remaining, um = explanation.remaining, output.micrometres
    if remaining is None:
        return
    parts = ""
    if remaining.carried_rms_um is not None and remaining.resting_rms_um is not None:
        parts = (
            f"; RMS of {explanation.target_word}s on the tool {um(remaining.carried_rms_um)} µm, of those beside the "
            f"machine {um(remaining.resting_rms_um)} µm"
        )
    expected = um(explanation.comparison.expected_rms_um)
    beyond = ", which is more than noise leaves" if remaining.beyond_noise else ""
    output.say(
        f"with what the model lacks added to it: RMS {um(remaining.rms_um)} µm, expected {expected} µm{beyond}{parts}"
    )


def _curve(explanation: CurveExplanation) -> None:
    output.say()
    for effect in explanation.missing:
        _curve_effect(effect, explanation.comparison.unit)
        _advice(effect, "rows")
    for reading in explanation.suspect_data:
        _bad_row(reading, explanation.comparison.unit)
    _next_step(explanation, f" --campaign {explanation.comparison.campaign}")


def _next_step(explanation: MachineExplanation | CurveExplanation, campaign: str = "") -> None:
    if explanation.missing:
        first, model = explanation.missing[0].effect, explanation.comparison.model
        together = explanation.added_together if isinstance(explanation, MachineExplanation) else (first,)
        every = [effect.effect for effect in explanation.missing]
        what = "it" if len(together) == 1 else "them"
        if len(every) > len(together):
            what = "the first" if len(together) == 1 else "these powers together"
        _add(what, together, f"{model} --as NAME{campaign}")
        if len(every) > len(together):
            _add(f"all {len(every)}", every, f"{model} --as NAME{campaign}")
    if isinstance(explanation, MachineExplanation) and explanation.stepped is not None:
        comparison = explanation.comparison
        of_campaign = f"{comparison.model} --as NAME --campaign {comparison.campaign}"
        _add("the step", (explanation.stepped.effect,), of_campaign)


def _add(what: str, effects: Sequence[str], to: str) -> None:
    """How to add some effects."""
    names = " ".join(f'"{effect}"' for effect in effects)
    output.say(f"to add {what}: monitor model add {names} --to {to}")


def _bad_probing(reading: BadProbing, target_word: str) -> None:
    output.say(
        f"bad point: run {reading.run}, sequence {reading.sequence}, {target_word} {reading.target}: "
        f"{_along(reading)} is off by {reading.size_um:.1f} µm{_turn(reading)}; it was left out"
    )


def _along(reading: BadProbing) -> str:
    """What is off, and in whose frame."""
    return reading.axis + ("" if reading.refers_to is None else f" (relative to {reading.refers_to})")


def _turn(reading: BadProbing) -> str:
    """By how much a whole pose is turned, beside its place."""
    return "" if reading.turn_urad is None else f" and its turn by {reading.turn_urad:.0f} µrad"


def _recurring_probing(reading: BadProbing, target_word: str) -> None:
    output.say(
        f"recurs in most runs: run {reading.run}, sequence {reading.sequence}, {target_word} {reading.target}: "
        f"{_along(reading)} is off by {reading.size_um:.1f} µm{_turn(reading)}; it was left out"
    )


def _bad_row(reading: BadRow, unit: str) -> None:
    output.say(
        f"outlier: row {reading.sequence} (line {reading.line}): {reading.axis} {reading.value:g} is off by "
        f"{four_digits(reading.size)} {unit}, {output.stated('p', reading.p_value)}; it was left out"
    )


def _advice(effect: MachineMissing | CurveMissing, answers_text: str, campaign: str = "CAMPAIGN") -> None:
    """Cause, remedy and rivals of an effect, and where to measure to tell them apart."""
    output.say(f"   cause: {effect.description.cause}")
    alone = remedy_holds_for(effect.effect, _of_another_correction(effect))
    output.say(f"   remedy{alone}: {effect.description.remedy}")
    if effect.indistinguishable_from:
        output.say(f"   these {answers_text} do not rule out: {', '.join(effect.indistinguishable_from)}")
        if effect.tell_apart_by:
            poses = "; ".join(
                ", ".join(f"{axis[:-4]} {value:g}°" for axis, value in pose.items())
                for pose in effect.tell_apart_by
            )
            output.say(f"   to tell them apart, probe also at {poses}")
        if isinstance(effect, MachineMissing):
            for tie in effect.ties:
                if tie.broken_by is not TieBreak.POSES:
                    output.say(f"   {_tie(effect.effect, tie, campaign)}")


def _of_another_correction(effect: MachineMissing | CurveMissing) -> list[str]:
    """The rivals of an effect but for those that one correction serves as well."""
    ties = effect.ties if isinstance(effect, MachineMissing) else ()
    served = {rival for tie in ties if tie.broken_by is TieBreak.NOTHING for rival in tie.rivals}
    return [rival for rival in effect.indistinguishable_from if rival not in served]


#: Ties that other runs break, or nothing.
_MORE_RUNS = (
    TieBreak.REPEATED,
    TieBreak.REFERENCES,
    TieBreak.MORE_RUNS,
    TieBreak.NO_POSES,
    TieBreak.ONE_LINE,
)


def _more_runs(rivals: str, tie: Tie) -> str:
    """What other runs do about rivals."""
    runs = "" if tie.runs is None else more_runs(tie.runs)
    if tie.broken_by is TieBreak.ONE_LINE:
        return f"no pose tells {rivals} apart: {ONE_LINE}"
    if tie.broken_by is TieBreak.NO_POSES:
        return f"{NO_POSE_TELLS} {rivals} apart{runs and ': '}{runs}"
    said = {TieBreak.REPEATED: MOVED_ONCE, TieBreak.REFERENCES: WHO_MOVED}.get(tie.broken_by, runs)
    return f"to tell {rivals} apart, {said}"


def _tie(effect: str, tie: Tie, campaign: str) -> str:
    """What to do about rivals that the poses above do not rule out."""
    rivals, drivers = ", ".join(tie.rivals), " and ".join(tie.drivers)
    if tie.broken_by is TieBreak.DRIVERS:
        return f"to tell {rivals} apart, measure {runs_that_tell(tie.drivers, within_runs=tie.within_runs)}"
    if tie.broken_by is TieBreak.INDEXATIONS:
        return (
            f"to tell {rivals} apart, bring {' and '.join(tie.axes)} to other positions while {drivers} acts"
        )
    if tie.broken_by is TieBreak.PLAN:
        acting = f", at poses probed while {drivers} acts" if drivers else ""
        return (
            f'to tell {rivals} apart{acting}: monitor plan {campaign} --separate "{effect},{tie.rivals[0]}"'
        )
    if tie.broken_by in _MORE_RUNS:
        return _more_runs(rivals, tie)
    if tie.broken_by is TieBreak.INSTRUMENT and tie.measurement is not None:
        return f"to tell {rivals} apart: {_test(tie.measurement)}"
    if tie.broken_by is TieBreak.INSTRUMENT:
        return f"to tell {rivals} apart, measure the same movements with another instrument"
    if tie.broken_by is TieBreak.REVERSED_ORDER:
        return f"to tell {rivals} apart, {runs_in_reversed_order(tie.runs or 1)}"
    if tie.broken_by is TieBreak.MORE_POSES:
        return f"to tell {rivals} apart, measure {poses_that_tell(tie.axes, (effect, *tie.rivals))}"
    if tie.step_mm is not None:
        return f"to tell {rivals} apart, measure {positions_that_tell(tie.axes, tie.step_mm)}"
    if tie.setup is not None:
        return f"no pose of this set-up tells {rivals} apart: {further_runs(tie.runs or 1)} {IN_WORDS[tie.setup]}"
    return (
        f"no touch of these targets tells {rivals} apart: they move the tip alike, and one correction serves both "
        "with this stylus"
    )


def _size_words(effect: MachineMissing) -> str:
    size = f"{output.rounded(effect.amplitude, effect.u)} ± {output.two_digits(effect.u)} {effect.unit}"
    if effect.largest is None:
        return size
    return f"up to {size} (the {'node' if effect.steps is None else 'step'} {effect.largest})"


def _unit_of_peak(effect: MachineMissing) -> str:
    return "µm" if effect.peak_urad is None else "µrad"


def _machine_effect(effect: MachineMissing, explanation: MachineExplanation) -> None:
    at = "tip" if explanation.target_word == "ball" else f"{explanation.target_word}s"
    unit = _unit_of_peak(effect)
    p_and_q = f"{output.stated('p', effect.p_value)}, {output.stated('q', effect.q_value)}"
    output.say(f"{effect.rank}. {effect.effect}: {effect.description.meaning}")
    output.say(f"   {_size_words(effect)}, at most {effect.peak_um:.1f} {unit} at the {at}; {p_and_q}")
    if explanation.rate is not None and effect.q_value > explanation.rate:
        output.say(
            f"   q is that of the whole scan and above its rate of {explanation.rate:g}: this was asked for "
            "afterwards, at a level of its own that it met"
        )
    if effect.error_peak_um is not None:
        error = effect.effect.partition(":")[0]
        output.say(
            f"   {error} with all of its effects: at most {effect.error_peak_um:.1f} {unit} at the {at}"
        )
    if effect.refers_to is not None:
        output.say(f"   relative to: {effect.refers_to}")
    if effect.shape_unknown:
        output.say(
            f"   shape unknown; nearest in the catalogue: {effect.nearest_shape}; --json has the curve"
        )
    if effect.reversal_value is not None:
        output.say(f"   {reversal_words(effect.reversal_value)}")
    if effect.searched is not None:
        output.say(f"   {_searched(effect.searched)}")
    _where(effect)
    if effect.travelled_periods is not None:
        output.say(
            f"   the axis turned {effect.travelled_periods:.2f} of its period: over less than 1.5 it is a smooth bend, "
            "and an offset, a tilt, flexure or another order looks alike"
        )
    if effect.within_its_shape:
        symbol = effect.effect.partition(":")[0]
        output.say(f"   not separable from the shape of {symbol}: {', '.join(effect.within_its_shape)}")
    um = output.micrometres
    held_out = [
        f"on held-out {what} {um(before)} -> {um(after)} µm"
        for what, before, after in (
            (explanation.held_out, effect.heldout_before_um, effect.heldout_after_um),
            ("poses", effect.heldout_poses_before_um, effect.heldout_poses_after_um),
        )
        if after is not None
    ] or ["too few readings to leave some out"]
    output.say(f"   RMS {um(effect.rms_before_um)} -> {um(effect.rms_after_um)} µm; {', '.join(held_out)}")


def _where(effect: MachineMissing) -> None:
    """Where an effect lies, as far as it was looked for: its steps, or the place at which a plate is held."""
    for step in effect.steps or ():
        size = f"{output.rounded(step.value, step.u)} ± {output.two_digits(step.u)} {effect.unit}"
        output.say(f"   {step_in_words(effect.effect, size, step.middle, step.width_mm)}")
    if effect.held_at is not None:
        places = (
            f"{held.axis} = {output.rounded(held.value, held.u)} ± {output.two_digits(held.u)} {held.unit}"
            for held in effect.held_at
        )
        output.say(f"   held at {', '.join(places)}")


def _searched(searched: SearchedValue) -> str:
    """What was searched besides the size, such as a pitch."""
    if searched.u is None:
        limit = (
            "" if searched.at_least is None else f": only that it is longer than {searched.at_least:.2g} min"
        )
        return f"{searched.what} not determined by these data{limit}"
    unit = "" if searched.unit == "1" else f" {searched.unit}"
    return f"{searched.what} {output.rounded(searched.value, searched.u)} ± {output.two_digits(searched.u)}{unit}"


def _curve_effect(effect: CurveMissing, unit: str) -> None:
    doubt = f" (likely, not certain: noise alone would do in {effect.noise_alone_p:.0%})"
    output.say(
        f"{effect.rank}. {effect.effect}: {effect.description.meaning}{'' if effect.certain else doubt}"
    )
    output.say(
        f"   {with_uncertainty(effect.amplitude, effect.u)} {effect.unit}, at most {four_digits(effect.peak)} {unit} "
        f"from its mean; {output.stated('p', effect.p_value)}, {output.stated('q', effect.q_value)}"
    )
    searched = effect.searched
    if searched is not None:
        output.say(f"   {searched.what} {with_uncertainty(searched.value, searched.u)} {searched.unit}")
    output.say(
        f"   RMS {four_digits(effect.rms_before)} -> {four_digits(effect.rms_after)} {unit}; on held-out rows "
        f"{four_digits(effect.heldout_before)} -> {four_digits(effect.heldout_after)} {unit}; "
        f"BIC {effect.bic_before:.1f} -> {effect.bic_after:.1f}"
    )
