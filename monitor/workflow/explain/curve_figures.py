"""The figure of a curve: what its model leaves, and how that falls as effects are added."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from monitor.discovery.curve.explain import CurveExplanation
from monitor.effects.curve import SEQUENCE
from monitor.methods.curve.fit import CurveFit, fit
from monitor.reporting.figures import titles
from monitor.reporting.figures.curve import MeasuredCurve, Residuals, residuals_figure
from monitor.reporting.figures.style import Figure
from monitor.workflow.figure_files import make_folder, save_figure


def curve_figures(first: CurveFit, explanation: CurveExplanation | None, folder: Path) -> list[str]:
    """Draw what the model leaves, with an explanation every missing effect too; return the names of the files."""
    make_folder(folder)
    name = "residual" if explanation is None else "missing-effects"
    return save_figure(residual_figure(first, explanation), folder, name)


def residual_figure(first: CurveFit, explanation: CurveExplanation | None) -> Figure:
    """Draw the residual of a comparison, or of an explanation with every effect added in turn."""
    curve = first.problem.curve
    column = _drawn_over(first, explanation)
    return residuals_figure(
        MeasuredCurve(
            first.problem.inputs.numbers[column],
            curve.measured,
            (first if explanation is None else explanation.final).problem.left_out,
            "row" if column == SEQUENCE else _with_unit(first, column),
            _with_unit(first, curve.response),
        ),
        _panels(first, explanation),
        title=titles.curve_residual(curve.name, None if explanation is None else len(explanation.missing)),
    )


def _drawn_over(first: CurveFit, explanation: CurveExplanation | None) -> str:
    """The input to draw over: that of the first missing effect, else the first of the model, else the time."""
    numbers = first.problem.inputs.numbers
    columns = [] if explanation is None else [effect.fitted.column for effect in explanation.missing]
    columns += [effect.column for effect in first.effects]
    clock = first.problem.curve.time or SEQUENCE
    return next((column for column in columns if column in numbers), clock)


def _with_unit(first: CurveFit, column: str) -> str:
    unit = first.problem.curve.units.get(column, "")
    return f"{column} / {unit}" if unit and not column.endswith(f"_{unit}") else column


def _panels(first: CurveFit, explanation: CurveExplanation | None) -> list[Residuals]:
    """The residual of the model as it is, and of every missing effect added to it in turn, without the outliers."""
    if explanation is not None:
        first = fit(replace(first.settled, left_out=explanation.final.problem.left_out))
    panels = [Residuals(titles.curve_as_it_is(first.rms), first.residual)]
    for effect in () if explanation is None else explanation.missing:
        first = fit(first.settled.with_effects([effect.fitted]))
        panels.append(Residuals(titles.curve_with(effect.effect, first.rms), first.residual))
    return panels
