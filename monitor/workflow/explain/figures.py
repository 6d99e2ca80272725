"""Figures of `compare`, `explain` and `model history`, drawn from their results into a folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from monitor.discovery import ChainComparison, Explanation, Fit
from monitor.effects import ChainEffect
from monitor.records import Array
from monitor.reporting.figures import titles
from monitor.reporting.figures.drivers import (
    DrivenResiduals,
    predicted_against_measured,
    residual_against_driver,
)
from monitor.reporting.figures.models import ErrorSteps, RankedEffects, error_falling, ranked_effects
from monitor.reporting.figures.residuals import residual_bars, residual_vectors
from monitor.reporting.figures.style import Figure
from monitor.reporting.figures.unknown_shape import ShapeCurve, unknown_shape
from monitor.units import MICROMETRE
from monitor.workflow.explain.explain_answer import MachineExplanation, MachineMissing
from monitor.workflow.explain.residuals import drivers_followed, in_machine_frame, mean_over_runs
from monitor.workflow.explain.residuals_against import against_effect
from monitor.workflow.explain.shape import shape_figure
from monitor.workflow.explain.version_answer import CurveVersion, MachineVersion
from monitor.workflow.figure_files import make_folder, save_figure

# A ball touched once a run is followed exactly: a smaller residual than this has nothing to show.
SMALLEST_SHOWN_UM = 0.005
# Rivals of an effect that a figure has room for.
MOST_RIVALS = 5


def comparison_figures(comparison: ChainComparison, fit: Fit, folder: Path) -> list[str]:
    """Draw where the model fails: by target, axis and run, over the workspace, against what it may depend on."""
    make_folder(folder)
    um = MICROMETRE.to_display
    groups = {}
    for name in ("target", "axis", "run"):
        residuals = {
            label: um(part.rms)
            for label, part in comparison.by.get(name, {}).items()
            if um(part.rms) > SMALLEST_SHOWN_UM
        }
        if residuals:
            groups[name] = (list(residuals), list(residuals.values()))
    level = um(comparison.expected_rms)
    title = titles.where_it_fails(comparison.campaign, um(comparison.rms), level, comparison.verdict.value)
    bars = residual_bars(groups, level_um=level, level_name=titles.EXPECTED, title=title)
    files = save_figure(bars, folder, "where-it-fails")
    files += _over_workspace(fit, *in_machine_frame(fit), folder)
    for name, driver, axis, residuals_um in drivers_followed(fit):
        figure = residual_against_driver(
            DrivenResiduals(driver, residuals_um),
            title=titles.residual_along(axis, name),
            driver_name=name,
            residual_name=titles.residual_axis(axis),
        )
        files += save_figure(figure, folder, f"residual-against-{name.split(' ')[0].lower()}")
    return files + shape_figure(comparison.campaign, fit, folder)


def _over_workspace(fit: Fit, positions: Array, vectors: Array, folder: Path) -> list[str]:
    figure = residual_vectors(*mean_over_runs(fit, positions, vectors), title=titles.OVER_WORKSPACE)
    return save_figure(figure, folder, "residual-vectors")


def explanation_figures(answer: MachineExplanation, explanation: Explanation, folder: Path) -> list[str]:
    """Draw what is missing: effects by evidence, the best against the measurement, the error falling."""
    make_folder(folder)
    missing = answer.missing
    if not missing:
        return []
    best = missing[0].effect
    noise_um = MICROMETRE.to_display(explanation.comparison.stated_uncertainty)
    title = titles.model_lacks(_drawn_name(missing[0])) if missing[0].shape_unknown else answer.answer
    files = save_figure(_ranked(missing, title), folder, "missing-effects")
    files += save_figure(_falling(missing, noise_um), folder, "error-falling")
    files += _unknown_shapes(missing, folder)
    files += _failing(explanation, best, _drawn_name(missing[0]), folder)
    prediction = _predicted(explanation, best)
    if prediction is not None:
        title = titles.predicts(_drawn_name(missing[0]))
        figure = predicted_against_measured(*prediction, title=title)
        files += save_figure(figure, folder, "predicted-against-measured")
    return files


def _ranked(missing: Sequence[MachineMissing], title: str) -> Figure:
    """Draw missing effects with their rivals; the sentences are in the answer, a bar has room for the size alone."""
    names: list[str] = []
    peaks: list[float] = []
    groups: list[int] = []
    notes: list[str] = []
    for effect in missing:
        rivals = effect.indistinguishable_from[:MOST_RIVALS]
        names += [_drawn_name(effect), *rivals]
        peaks += [effect.peak_um] * (1 + len(rivals))
        groups += [effect.rank] * (1 + len(rivals))
        notes += [titles.effect_size(effect.amplitude, effect.u, effect.unit)]
        notes += [titles.NOT_RULED_OUT] * len(rivals)
    effects = RankedEffects(names, peaks, groups, notes)
    return ranked_effects(effects, title=title, value_name=titles.PEAK)


def _drawn_name(effect: MachineMissing) -> str:
    """The name of an effect where there is little room: the parts of an unknown shape are left out."""
    return titles.effect_name(effect.effect, shape_unknown=effect.shape_unknown)


def _unknown_shapes(missing: Sequence[MachineMissing], folder: Path) -> list[str]:
    """Draw the curve of every effect whose shape the catalogue does not have."""
    files = []
    for effect in missing:
        if effect.curve:
            error = effect.effect.partition(":")[0]
            figure = unknown_shape(
                ShapeCurve(
                    [point.at for point in effect.curve],
                    [point.direction for point in effect.curve],
                    [point.value for point in effect.curve],
                    [point.u for point in effect.curve],
                ),
                title=titles.unknown_shape_of(error, effect.nearest_shape),
                axis_name=titles.reading_of(error[2:].lstrip("0")),
                value_name=f"{error} / {effect.unit}",
            )
            files += save_figure(figure, folder, f"shape-of-{error.lower()}")
    return files


def _failing(explanation: Explanation, effect: str, shown: str, folder: Path) -> list[str]:
    """Draw where the model fails, and the residual against what drives the effect, before and after it is added."""
    files = []
    final, before = explanation.final, explanation.comparison.vectors
    if before.shape[1] == 3:
        files += _over_workspace(final, *in_machine_frame(final, before), folder)
    against = against_effect(explanation, effect)
    if against is not None:
        figure = residual_against_driver(
            DrivenResiduals(against.at, against.before, against.groups, after_um=against.after),
            title=titles.residual_follows(shown, against.along),
            driver_name=against.driver,
            residual_name=titles.residual_axis(against.along),
        )
        files += save_figure(figure, folder, "missing-effect-before-after")
    return files


def _not_a_number_for_none(values: list[float | None]) -> list[float]:
    return [np.nan if value is None else value for value in values]


def _falling(missing: Sequence[MachineMissing], noise_um: float) -> Figure:
    rms = [missing[0].rms_before_um, *(effect.rms_after_um for effect in missing)]
    held_out = [missing[0].heldout_before_um, *(effect.heldout_after_um for effect in missing)]
    names = [titles.AS_IT_IS, *(f"+ {_drawn_name(effect)}" for effect in missing)]
    steps = ErrorSteps(
        names, rms, _not_a_number_for_none(held_out), noise_um, titles.Noise.STATED_BY_PROBE.value
    )
    return error_falling(steps, title=titles.error_falls(rms[0], rms[-1]))


def _predicted(explanation: Explanation, text: str) -> tuple[Array, Array] | None:
    """Return the prediction of an effect at every probing and the residual without it, µm, along its main axis."""
    fit = explanation.final
    start = 0
    for effect in fit.problem.added:
        basis = effect.basis(fit.problem.context)
        if effect.text == text and isinstance(effect, ChainEffect):
            displacement = fit.moved_by(basis) @ fit.solution.common[start : start + basis.size]
            axis = int(np.argmax(np.sum(displacement**2, axis=0)))
            um = MICROMETRE.to_display(1.0)
            # The effect explains the residual with the opposite sign: what is measured without it is its negative.
            return -displacement[:, axis] * um, (fit.vectors[:, axis] - displacement[:, axis]) * um
        start += basis.size
    return None


def history_figures(steps: Sequence[MachineVersion | CurveVersion], folder: Path) -> list[str]:
    """Draw the error falling, version by version."""
    make_folder(folder)
    first, last = steps[0], steps[-1]
    noise, noise_name = _noise_floor(last)
    unit = "" if last.unit == "1" else last.unit
    named_unit = None if isinstance(last, CurveVersion) else unit
    figure = error_falling(
        ErrorSteps(
            [step.model if step.added is None else f"+ {step.added}" for step in steps],
            [step.rms for step in steps],
            _not_a_number_for_none([step.heldout_rms for step in steps]),
            noise,
            noise_name.value,
            unit,
        ),
        title=titles.versions_fall(last.model, last.campaign, first.rms, last.rms, named_unit),
    )
    return save_figure(figure, folder, "error-falling")


def _noise_floor(step: MachineVersion | CurveVersion) -> tuple[float, titles.Noise]:
    """The noise below which no error falls, and its name; 0 for a curve that states none and has no repeats."""
    if isinstance(step, MachineVersion):
        return step.stated_uncertainty_um, titles.Noise.STATED_BY_PROBE
    floor = step.stated_uncertainty or step.repeatability
    return (0.0, titles.Noise.UNKNOWN) if floor is None else (floor, titles.Noise.STATED_OR_REPEATABILITY)
