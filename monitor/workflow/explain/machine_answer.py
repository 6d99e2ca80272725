"""Comparison and explanation of a machine as answers: in display units, with the findings in sentences."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from monitor.discovery import ChainComparison, ChainMissing, Explanation, Mistake
from monitor.discovery.machine.suspects.steps import Step
from monitor.discovery.machine.suspects.suspects import MOST_BAD_POINTS
from monitor.machine import Chain
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.chain.touch import TouchProblem
from monitor.records import FrameKind, FrameOfReference, Verdict
from monitor.reporting.frames import frame_words
from monitor.reporting.machine_finding import (
    ONE_RUN,
    SMALL_MOVES,
    WHOLE_PIECE,
    MachineFinding,
    MissingEffect,
    MistakeFound,
    Move,
    Scattering,
    fits_too_well,
    machine_sentences,
    size_if_late,
)
from monitor.reporting.nearest_words import WHY_REFUSED
from monitor.units import DEGREE, MICROMETRE, MILLIMETRE, MINUTE, Unit
from monitor.workflow.explain.compare_answer import MachineComparison, MachinePart
from monitor.workflow.explain.explain_answer import (
    ChangedParameter,
    ChangedTarget,
    CurvePoint,
    DeviationsApart,
    HeldAt,
    InstrumentAlias,
    MachineExplanation,
    MachineMissing,
    MovedTarget,
    NearestEffect,
    Remaining,
    StepBetween,
    SteppedError,
)
from monitor.workflow.explain.off_answer import left_out, said_off, scattering_targets, targets_off, unlike
from monitor.workflow.explain.residuals_against import pictures_of
from monitor.workflow.explain.shared_answer import (
    coefficients,
    coinciding,
    lack_of_fit_test,
    rivals,
    searched_value,
)
from monitor.workflow.explain.ties import ties_of
from monitor.workflow.identify.answer import Estimate, LikelyMistake, reversal_value
from monitor.workflow.instruments.too_well import TOO_WELL
from monitor.workflow.uncertainty.machine_frame import refers_to

#: A residual beyond so many stated standard uncertainties after the search leaves no result of it standing.
HOPELESS_TIMES = 100.0
#: A power of the position, without a driver.
POWER = re.compile(r"(?P<error>\w+):poly\d+")
#: The numbers of a residual that is a vector.
COORDINATES = ("x", "y", "z")


def micrometres(length: float | None) -> float | None:
    """A length in mm in micrometres; None where there is none."""
    return None if length is None else MICROMETRE.to_display(length)


def residual_frames(problem: ChainProblem) -> dict[str, str]:
    """What x, y and z of a residual are stated in, in words; empty where readings are no vectors."""
    if problem.components != COORDINATES:
        return {}
    work, instruments = problem.context.chain.work, problem.context.instruments
    frame = (
        FrameOfReference(FrameKind.OWN_AXIS, work[-1].name) if work else FrameOfReference(FrameKind.MACHINE)
    )
    setups = () if instruments is None else instruments.setups
    frames = [f"setup {setup.id}" if setup.has_own_frame else frame_words(frame) for setup in setups]
    return dict.fromkeys(COORDINATES, " or ".join(dict.fromkeys(frames)) or frame_words(frame))


def machine_comparison(comparison: ChainComparison, problem: ChainProblem) -> MachineComparison:
    """The comparison of a machine, measured by ``problem``, in micrometres."""
    um = MICROMETRE.to_display
    return MachineComparison(
        campaign=comparison.campaign,
        model=comparison.model,
        rms_um=um(comparison.rms),
        largest_um=um(float(np.abs(comparison.vectors[~comparison.left_out]).max())),
        repeatability_um=micrometres(comparison.repeatability),
        expected_rms_um=um(comparison.expected_rms),
        residual_deviation_um=um(comparison.residual_deviation),
        stated_uncertainty_um=um(comparison.stated_uncertainty),
        lack_of_fit=lack_of_fit_test(comparison.lack_of_fit),
        excess_over_statement_p=comparison.excess_p_value,
        verdict=comparison.verdict,
        by={
            kind: {
                name: MachinePart(um(part.rms), um(part.largest), part.count) for name, part in parts.items()
            }
            for kind, parts in comparison.by.items()
        },
        refers_to=residual_frames(problem) or None,
        are_angles=None if problem.is_length.any() else True,
    )


def _curve(effect: ChainMissing, unit: Unit) -> tuple[CurvePoint, ...]:
    """The curve of an unknown shape in display units; empty where the catalogue has the shape."""
    curve = effect.curve
    if curve is None:
        return ()
    at = curve.at / DEGREE.factor if curve.turns else curve.at
    rows = zip(at, curve.direction, curve.size, curve.u, strict=True)
    return tuple(
        CurvePoint(float(position), int(direction), unit.to_display(float(size)), unit.to_display(float(u)))
        for position, direction, size, u in rows
    )


def has_plan_of_pairs(problem: ChainProblem) -> bool:
    """Whether `monitor plan --separate` selects poses for a pair of effects: it does of balls that are touched."""
    return isinstance(problem, TouchProblem)


def _machine_missing(effect: ChainMissing, chain: Chain, *, is_planned: bool) -> MachineMissing:
    unit, um = effect.unit or effect.units[0], MICROMETRE.to_display
    return MachineMissing(
        rank=effect.rank,
        effect=effect.effect,
        description=effect.description,
        amplitude=unit.to_display(effect.amplitude),
        u=unit.to_display(effect.u),
        unit=unit.name,
        coefficients=coefficients(effect),
        peak_um=um(effect.peak),
        p_value=effect.p_value,
        q_value=effect.q_value,
        rms_before_um=um(effect.rms_before),
        rms_after_um=um(effect.rms_after),
        heldout_before_um=micrometres(effect.held_out_before),
        heldout_after_um=micrometres(effect.held_out_after),
        heldout_days_before_um=micrometres(effect.held_out_days_before),
        heldout_days_after_um=micrometres(effect.held_out_days_after),
        heldout_poses_before_um=micrometres(effect.held_out_poses_before),
        heldout_poses_after_um=micrometres(effect.held_out_poses_after),
        indistinguishable_from=rivals(effect),
        coinciding=coinciding(effect),
        tell_apart_by=tuple(
            {
                f"{axis.lower()}_deg": round(chain.joint(axis).sign * DEGREE.to_display(angle), 6) + 0.0
                for axis, angle in pose.items()
            }
            for pose in effect.separation.poses
        ),
        standard_deviations_apart=DeviationsApart(effect.separation.before, effect.separation.after),
        varies_from_run_to_run=effect.varies,
        shape_unknown=effect.nearest is not None,
        nearest_shape=effect.nearest,
        curve=_curve(effect, effect.units[0]),
        searched=searched_value(effect),
        travelled_periods=effect.travelled_periods,
        within_its_shape=effect.within_its_shape,
        reversal_value=reversal_value(
            effect.effect, Estimate(unit.to_display(effect.amplitude), unit.to_display(effect.u), unit.name)
        ),
        ties=ties_of(effect, rivals(effect), is_planned=is_planned),
        refers_to=refers_to((effect.effect,), chain).get(effect.effect),
        largest=effect.largest,
        error_peak_um=micrometres(effect.error_peak),
        peak_urad=um(effect.peak) if effect.turns else None,
        held_at=tuple(HeldAt(held.axis, held.reading, held.u, MILLIMETRE.name) for held in effect.held)
        or None,
        steps=_steps_between(effect),
    )


def _steps_between(effect: ChainMissing) -> tuple[StepBetween, ...] | None:
    """The steps of an effect, each between its readings; None where it has none."""
    sizes = coefficients(effect).values()
    return (
        tuple(
            StepBetween(
                size.value,
                size.u,
                between.low,
                between.high,
                between.width or None,
                between.middle if between.width else None,
            )
            for size, between in zip(sizes, effect.steps, strict=False)
        )
        or None
    )


def _step(step: Step, units: Mapping[str, Unit], chain: Chain) -> ChangedTarget | ChangedParameter:
    if step.parameter is None:
        assert step.target is not None
        um = MICROMETRE.to_display
        return ChangedTarget(step.target, step.run, um(step.size), um(step.u), MICROMETRE.name, step.p_value)
    unit = units[step.parameter]
    return ChangedParameter(
        step.parameter, step.run, unit.to_display(step.size), unit.to_display(step.u), unit.name, step.p_value,
        refers_to((step.parameter,), chain).get(step.parameter),
    )  # fmt: skip


def _changes(explanation: Explanation) -> tuple[MovedTarget | ChangedTarget | ChangedParameter, ...]:
    """Targets that moved in a run, then steps between runs."""
    problem, um = explanation.final.problem, MICROMETRE.to_display
    units = problem.base_units
    moved = (
        MovedTarget(
            move.target, move.run, move.sequence, um(move.size), tuple(um(part) for part in move.shift),
            MICROMETRE.name, move.p_value, move.of_all or None,
        )
        for move in explanation.moves
    )  # fmt: skip
    return (*moved, *(_step(step, units, problem.context.chain) for step in explanation.steps))


def _remaining(explanation: Explanation) -> Remaining | None:
    """What the model with all findings leaves; None where there are none."""
    if not explanation.missing and explanation.stepped is None:
        return None
    final = explanation.final
    um = MICROMETRE.to_display
    resting = np.isin(final.problem.context.target, list(final.problem.resting))[:, None]

    def rms(rows: npt.NDArray[np.bool_]) -> float | None:
        inside = rows & final.has_weight
        return um(float(np.sqrt(np.mean(final.vectors[inside] ** 2)))) if inside.any() else None

    return Remaining(
        deviation_um=um(final.sigma * final.scale),
        # Weights of targets that scatter are nobody's statement.
        stated_uncertainty_um=um(
            explanation.comparison.stated_uncertainty if explanation.scatter else final.sigma
        ),
        rms_um=um(final.rms),
        carried_rms_um=rms(~resting) if resting.any() else None,
        resting_rms_um=rms(resting),
        beyond_noise=explanation.more_is_left or None,
    )


def _nearest(explanation: Explanation) -> NearestEffect | None:
    """The effect that comes nearest where none is named."""
    nearest, um = explanation.nearest, MICROMETRE.to_display
    if nearest is None:
        return None
    return NearestEffect(
        nearest.effect, um(nearest.rms_before), um(nearest.rms_after), nearest.refusal.value,
        WHY_REFUSED[nearest.refusal],
    )  # fmt: skip


def _stepped(explanation: Explanation) -> SteppedError | None:
    """The error that stepped within a run."""
    step, um = explanation.stepped, MICROMETRE.to_display
    if step is None:
        return None
    unit, moment, named = step.effect.unit, step.moment, {effect.effect for effect in explanation.missing}
    return SteppedError(
        step.effect.text, step.errors, moment.run, moment.sequence, unit.to_display(step.size),
        unit.to_display(step.u), unit.name, um(step.rms_before), um(step.rms_after),
        tuple(effect for effect in step.instead_of if effect not in named),
    )  # fmt: skip


def is_hopeless(explanation: Explanation) -> bool:
    """Whether the search left a residual beyond anything that effects of a machine leave."""
    return explanation.final.rms > HOPELESS_TIMES * explanation.final.sigma


def mistakes_found(mistakes: Sequence[Mistake]) -> list[MistakeFound]:
    """Mistakes as a sentence says them."""
    return [
        MistakeFound(each.what, each.rms_as_recorded, each.rms_undone, each.enough, each.untried)
        for each in mistakes
    ]


def _as_said(effect: MachineMissing) -> MissingEffect:
    """A missing effect as a sentence says it."""
    nearest = (effect.nearest_shape or "") if effect.shape_unknown else None
    return MissingEffect(
        effect.effect, effect.description.meaning, nearest, effect.varies_from_run_to_run,
        effect.indistinguishable_from,
    )  # fmt: skip


def _move(change: MovedTarget | ChangedTarget | ChangedParameter, target_word: str) -> Move:
    """A change as a sentence says it."""
    stepped = isinstance(change, ChangedParameter)
    if isinstance(change, ChangedParameter):
        subject = change.parameter
    elif isinstance(change, MovedTarget) and change.of_all:
        subject = WHOLE_PIECE
    else:
        subject = f"{target_word} {change.target}"
    sequence = change.sequence if isinstance(change, MovedTarget) else None
    return Move(subject, stepped, change.size, change.unit, change.run, sequence)


def _undecided(explanation: Explanation) -> tuple[str, ...]:
    """What the campaign cannot decide, in sentences."""
    scale = explanation.final.scale
    said = (ONE_RUN,) if len(explanation.final.problem.runs) == 1 else ()
    if explanation.small_moves_turn_nothing:
        said = (*said, SMALL_MOVES)
    said = (*said, *(_if_late(effect) for effect in explanation.missing if effect.if_late))
    return (*said, fits_too_well(1.0 / scale)) if 0.0 < scale < TOO_WELL else said


def _if_late(effect: ChainMissing) -> str:
    """How large an effect is if it follows its temperature late."""
    unit = effect.unit or effect.units[0]
    sizes = [
        (MINUTE.to_display(each.time_constant_s), unit.to_display(each.amplitude), unit.to_display(each.u))
        for each in effect.if_late
    ]
    return size_if_late(effect.effect, unit.name, sizes)


def machine_explanation(explanation: Explanation) -> MachineExplanation:
    """The explanation of a machine: what a comparison says, what the model lacks, and readings and changes."""
    problem, um = explanation.final.problem, MICROMETRE.to_display
    is_explained = explanation.comparison.verdict is not Verdict.SOMETHING_IS_MISSING
    missing = tuple(
        _machine_missing(effect, problem.context.chain, is_planned=has_plan_of_pairs(problem))
        for effect in explanation.missing
    )
    comparison = machine_comparison(explanation.comparison, problem)
    suspect_data, recurring_data = (
        left_out(points, problem) for points in (explanation.suspect, explanation.recurring)
    )
    off_targets, changes = targets_off(explanation), _changes(explanation)
    scattering, unlike_runs = scattering_targets(explanation), unlike(explanation)
    nearest, stepped = _nearest(explanation), _stepped(explanation)
    # Where nothing is missing there is nothing to picture.
    pictures = None if is_explained else pictures_of(explanation, missing[0].effect if missing else None)
    residual_map, residual_against = pictures or (None, None)
    return MachineExplanation(
        comparison=comparison,
        missing=missing,
        suspect_data=suspect_data,
        changes=changes,
        blind_spots=tuple(explanation.blind),
        not_recorded=dict(explanation.refused),
        target_word=problem.target_word,
        held_out="runs" if len(problem.runs) > 1 else "blocks of poses",
        likely_mistakes=tuple(
            LikelyMistake(mistake.what, um(mistake.rms_as_recorded), um(mistake.rms_undone), mistake.enough)
            for mistake in explanation.mistakes
        ),
        undecided=_undecided(explanation),
        answer=machine_sentences(
            MachineFinding(
                explained=is_explained,
                missing=[_as_said(effect) for effect in missing],
                bad_points=len(suspect_data),
                moves=tuple(_move(change, problem.target_word) for change in changes),
                scattering=tuple(
                    Scattering(problem.target_word, each.target, each.times, each.deviation_um)
                    for each in scattering
                ),
                unlike_runs=unlike_runs,
                limits=explanation.limits,
                most_bad_points=MOST_BAD_POINTS,
                unfitted=explanation.unfitted,
                hopeless=is_hopeless(explanation),
                mistakes=mistakes_found(explanation.mistakes),
                unseen=explanation.together is Verdict.EXPLAINED,
                tolerated=comparison.exceeds_statement,
                not_followed=explanation.not_followed,
                recurring=len({(reading.run, reading.sequence) for reading in recurring_data}),
                unchecked=explanation.unchecked,
                off_targets=said_off(off_targets, problem.target_word),
                contradicted=is_explained and explanation.together is Verdict.SOMETHING_IS_MISSING,
                nearest=nearest,
                stepped=stepped,
                more_is_left=explanation.more_is_left,
            )
        ),
        residual_map=residual_map,
        residual_against=residual_against,
        not_fitted=explanation.unfitted,
        not_followed=explanation.not_followed,
        recurring_data=recurring_data,
        off_targets=off_targets,
        limits_reached=tuple(explanation.limits),
        remaining=_remaining(explanation),
        taken_for_machine=_aliases(explanation),
        scattering=scattering,
        unlike_runs=unlike_runs,
        added_together=_added_together([effect.effect for effect in missing]),
        nearest=nearest,
        stepped=stepped,
    )


def _added_together(missing: Sequence[str]) -> tuple[str, ...]:
    """The first effect, and the powers of the same error where it is one: a bend about the middle of the travel is a
    line and a parabola, each of which takes the part of the other."""
    first = [POWER.fullmatch(effect) for effect in missing[:1]]
    if not first or first[0] is None:
        return tuple(missing[:1])
    powers = [power for effect in missing if (power := POWER.fullmatch(effect)) is not None]
    return tuple(power[0] for power in powers if power["error"] == first[0]["error"])


def _aliases(explanation: Explanation) -> tuple[InstrumentAlias, ...]:
    """Errors of instruments that base parameters take up, those with the same parameters together."""
    groups: dict[tuple[str, ...], tuple[str, ...]] = {}
    for alias in explanation.taken_for_machine:
        groups[alias.by] = (*groups.get(alias.by, ()), alias.parameter)
    return tuple(InstrumentAlias(effects, parameters) for parameters, effects in groups.items())
