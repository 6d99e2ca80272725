"""Figures of curves: the residual falling as effects are added, and the error of every version of a model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from monitor.discovery.curve.explain import CurveExplanation
from monitor.effects.curve import SEQUENCE
from monitor.methods.curve.method import CurveFit, fit
from monitor.methods.curve.problem import CurveProblem
from monitor.reporting.figures.curve import Residuals, residuals_figure
from monitor.reporting.figures.models import ErrorSteps, error_falling
from monitor.reporting.figures.style import save
from monitor.workflow.figure_files import make_folder

Document = dict[str, Any]


def _axis(found: CurveFit, explanation: CurveExplanation | None) -> str:
    """The input to draw over: that of the first missing effect, else the first of the model, else the time."""
    numbers = found.problem.inputs.numbers
    wanted = [] if explanation is None else [one.fitted.column for one in explanation.missing]
    wanted += [effect.column for effect in found.effects]
    clock = found.problem.curve.time or SEQUENCE
    return next((name for name in wanted if name in numbers), clock)


def _with_unit(found: CurveFit, name: str) -> str:
    unit = found.problem.curve.units.get(name, "")
    return f"{name} / {unit}" if unit and not name.endswith(f"_{unit}") else name


def residual_figure(found: CurveFit, explanation: CurveExplanation | None) -> Any:
    """The figure of a comparison, or of an explanation with every effect added in turn."""
    curve = found.problem.curve
    name = _axis(found, explanation)
    panels = [Residuals(f"model as it is: RMS {found.rms:.4g}", found.residual)]
    out = found.problem.left_out
    if explanation is not None:
        out = explanation.final.problem.left_out
        now = fit(_without(found, explanation))
        panels = [Residuals(f"model as it is: RMS {now.rms:.4g}", now.residual)]
        for one in explanation.missing:
            now = fit(now.settled.with_effects([one.fitted]))
            panels.append(Residuals(f"+ {one.effect}: RMS {now.rms:.4g}", now.residual))
    return residuals_figure(
        found.problem.inputs.numbers[name],
        curve.measured,
        x_name="row" if name == SEQUENCE else _with_unit(found, name),
        response=_with_unit(found, curve.response),
        residuals=panels,
        outliers=out,
        title=_title(curve.name, explanation, panels),
    )


def _without(found: CurveFit, explanation: CurveExplanation) -> CurveProblem:
    """The model as given, without the outliers that the explanation left out."""
    return replace(found.settled, left_out=explanation.final.problem.left_out)


def _title(name: str, explanation: CurveExplanation | None, panels: list[Residuals]) -> str:
    if explanation is None:
        return f"{name}: what the model leaves"
    if not explanation.missing:
        return f"{name}: nothing is missing that these rows can show"
    return f"{name}: {len(explanation.missing)} missing effect{'s' if len(explanation.missing) > 1 else ''} found"


def curve_figures(found: CurveFit, explanation: CurveExplanation | None, folder: Path) -> list[str]:
    """Draw a comparison or an explanation; the files that were made."""
    make_folder(folder)
    name = "residual" if explanation is None else "missing-effects"
    return [
        str(save(residual_figure(found, explanation), folder / f"{name}.{kind}")) for kind in ("svg", "png")
    ]


def curve_history_figure(steps: list[Document], folder: Path) -> list[str]:
    """The error falling, version by version."""
    make_folder(folder)
    floor = steps[-1]["stated_uncertainty"] or steps[-1]["repeatability"]
    figure = error_falling(
        ErrorSteps(
            [one["model"] if one["added"] is None else f"+ {one['added']}" for one in steps],
            [one["rms"] for one in steps],
            [np.nan if one["heldout_rms"] is None else one["heldout_rms"] for one in steps],
            0.0 if floor is None else floor,
            "no repeats" if floor is None else "stated uncertainty or repeatability",
            "" if steps[0]["unit"] == "1" else steps[0]["unit"],
        ),
        title=f"{steps[-1]['model']} on {steps[-1]['campaign']}: "
        f"the error falls from {steps[0]['rms']:.4g} to {steps[-1]['rms']:.4g}",
    )
    return [str(save(figure, folder / f"error-falling.{kind}")) for kind in ("svg", "png")]
