"""What `monitor explain` prints: the comparison, the missing effects, bad readings, and the finding in sentences."""

from __future__ import annotations

from monitor.cli import output, residual_output
from monitor.cli.residual_output import four_digits, with_uncertainty
from monitor.workflow.explain.compare_answer import CurveComparison
from monitor.workflow.explain.explain_answer import (
    BadProbing,
    BadRow,
    CurveMissing,
    ExplainAnswer,
    MachineFindings,
    MachineMissing,
)

#: So many blind spots are named.
NAMED_BLIND_SPOTS = 6


def show(answer: ExplainAnswer) -> None:
    """Print an explanation."""
    comparison, machine = answer.comparison, answer.machine
    if machine is not None and machine.likely_mistakes:
        output.say(answer.answer)
        residual_output.summary(comparison)
        return
    residual_output.summary(comparison)
    output.say()
    for effect in answer.missing:
        _effect(effect, answer)
    for reading in answer.suspect_data:
        _bad_reading(reading, answer)
    output.say(answer.answer)
    if answer.missing:
        on_curve = f" --campaign {comparison.campaign}" if isinstance(comparison, CurveComparison) else ""
        output.say(
            f'to add it: monitor model add "{answer.missing[0].effect}" --to {comparison.model} --as NAME{on_curve}'
        )
    for sentence in machine.undecided if machine is not None else ():
        output.say(sentence)
    if machine is not None and answer.blind_spots:
        names = ", ".join(answer.blind_spots[:NAMED_BLIND_SPOTS])
        output.say(
            f"blind spots of this plan: {len(answer.blind_spots)} effects leave nothing to see "
            f"({names}, ...); --json lists them"
        )
    residual_output.files(answer.figures)


def _bad_reading(reading: BadProbing | BadRow, answer: ExplainAnswer) -> None:
    if isinstance(reading, BadProbing):
        assert answer.machine is not None
        target = f"{answer.machine.target_word} {reading.target}"
        output.say(
            f"bad point: run {reading.run}, sequence {reading.sequence}, {target}: {reading.axis} is off by "
            f"{reading.size_um:.1f} µm; it was left out"
        )
        return
    output.say(
        f"outlier: row {reading.sequence} (line {reading.line}): {reading.axis} {reading.value:g} is off by "
        f"{four_digits(reading.size)} {answer.comparison.unit}, {output.stated('p', reading.p_value)}; it was left out"
    )


def _effect(effect: MachineMissing | CurveMissing, answer: ExplainAnswer) -> None:
    """An effect with its size and evidence, the errors without and with it, cause, remedy and rivals."""
    if isinstance(effect, MachineMissing):
        assert answer.machine is not None
        _machine_effect(effect, answer.machine)
    else:
        _curve_effect(effect, answer.comparison.unit)
    output.say(f"   cause: {effect.cause}")
    output.say(f"   remedy: {effect.remedy}")
    if effect.indistinguishable_from:
        data = "data" if isinstance(effect, MachineMissing) else "rows"
        output.say(f"   these {data} do not rule out: {', '.join(effect.indistinguishable_from)}")
        if effect.tell_apart_by:
            poses = "; ".join(
                ", ".join(f"{axis[:-4]} {value:g}°" for axis, value in pose.items())
                for pose in effect.tell_apart_by
            )
            output.say(f"   to tell them apart, probe also at {poses}")


def _machine_effect(effect: MachineMissing, machine: MachineFindings) -> None:
    at = "tip" if machine.target_word == "ball" else f"{machine.target_word}s"
    output.say(f"{effect.rank}. {effect.effect}: {effect.meaning}")
    output.say(
        f"   {output.rounded(effect.amplitude, effect.u)} ± {output.two_digits(effect.u)} {effect.unit}, at most "
        f"{effect.peak_um:.1f} µm at the {at}; {output.stated('p', effect.p_value)}, "
        f"{output.stated('q', effect.q_value)}"
    )
    searched = effect.searched
    if searched is not None:
        u = "" if searched.u is None else f" ± {output.two_digits(searched.u)}"
        unit = "" if searched.unit == "1" else f" {searched.unit}"
        output.say(f"   {searched.what} {output.rounded(searched.value, searched.u)}{u}{unit}")
    um = output.micrometres
    output.say(
        f"   RMS {um(effect.rms_before_um)} -> {um(effect.rms_after_um)} µm; on held-out {machine.held_out} "
        f"{um(effect.heldout_before_um)} -> {um(effect.heldout_after_um)} µm"
    )


def _curve_effect(effect: CurveMissing, unit: str) -> None:
    doubt = f" (likely, not certain: noise alone would do in {effect.noise_alone_p:.0%})"
    output.say(f"{effect.rank}. {effect.effect}: {effect.meaning}{'' if effect.certain else doubt}")
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
