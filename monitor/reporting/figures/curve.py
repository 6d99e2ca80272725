"""Draws a curve: the measured response, and the residual of one model after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import shorten

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.figures.style import new_figure, style, zero_line
from monitor.reporting.palette import BLUE, INK, ORANGE, PAGE_WIDTH_MM

PANEL_MM = 30.0
HEAD_MM = 22.0
#: Of more panels than these the first ones and the last are drawn.
MOST_PANELS = 5
#: Letters of a panel's title that have room in one line.
_MOST_LETTERS = 92


@dataclass(frozen=True)
class Residuals:
    """The residual (n,) of a model and the title of its panel."""

    title: str
    values: Array


@dataclass(frozen=True)
class MeasuredCurve:
    """The ``measured`` response (n,) over an input ``x`` (n,), with the names of both; ``outliers`` (n,) are ringed."""

    x: Array
    measured: Array
    outliers: npt.NDArray[np.bool_]
    x_name: str
    response: str


def residuals_figure(curve: MeasuredCurve, residuals: Sequence[Residuals], *, title: str) -> Figure:
    """Draw the response over an input on top, below it the residual of each model."""
    x, outliers = curve.x, curve.outliers
    if any(residual.values.shape != x.shape for residual in residuals) or curve.measured.shape != x.shape:
        raise DataError(f"response and residuals must have the {len(x)} rows of {curve.x_name}")
    shown = [*residuals[: MOST_PANELS - 1], residuals[-1]] if len(residuals) > MOST_PANELS else [*residuals]
    with style():
        figure = new_figure(PAGE_WIDTH_MM, HEAD_MM + PANEL_MM * (1 + len(shown)), title)
        axes = figure.subplots(1 + len(shown), 1, sharex=True, squeeze=False)[:, 0]
        axes[0].plot(x, curve.measured, ".", color=INK, markersize=3.0)
        axes[0].set_ylabel(curve.response)
        for panel, residual in zip(axes[1:], shown, strict=True):
            zero_line(panel)
            panel.plot(x, residual.values, ".", color=BLUE, markersize=3.0)
            panel.plot(
                x[outliers],
                residual.values[outliers],
                "o",
                markersize=6.0,
                markerfacecolor="none",
                color=ORANGE,
            )
            panel.set_title(shorten(residual.title, _MOST_LETTERS, placeholder=" …"))
            panel.set_ylabel("residual")
        axes[-1].set_xlabel(curve.x_name)
    return figure
