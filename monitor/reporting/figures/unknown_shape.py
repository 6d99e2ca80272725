"""Draws the curve of an effect whose shape the catalogue does not have, with its band."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from monitor.records import Array
from monitor.reporting.figures.style import caption, new_figure, style, zero_line
from monitor.reporting.palette import BLUE, ORANGE, PAGE_WIDTH_MM

#: The band is so many standard uncertainties to each side.
K = 2.0


@dataclass(frozen=True)
class ShapeCurve:
    """Sizes (m,) with standard uncertainties (m,) at readings (m,), to which an axis came in a direction (m,) of 1 or
    -1."""

    at: npt.ArrayLike
    direction: npt.ArrayLike
    size: npt.ArrayLike
    u: npt.ArrayLike


def unknown_shape(curve: ShapeCurve, *, title: str, axis_name: str, value_name: str) -> Figure:
    """Draw a curve, a line and a band for each direction of travel."""
    at, direction, size, u = (
        np.asarray(values, dtype=np.float64) for values in (curve.at, curve.direction, curve.size, curve.u)
    )
    with style():
        figure = new_figure(0.72 * PAGE_WIDTH_MM, 78.0, title)
        axes = figure.subplots()
        zero_line(axes)
        for sign, colour, name in ((1.0, BLUE, "rising"), (-1.0, ORANGE, "falling")):
            rows = direction == sign
            if rows.any():
                x, y, half = _in_order(at[rows], size[rows], K * u[rows])
                axes.fill_between(x, y - half, y + half, color=colour, alpha=0.2, linewidth=0)
                axes.plot(x, y, "o-", color=colour, markersize=3, linewidth=0.9, label=name)
        axes.legend(frameon=False)
        caption(
            figure,
            "where the axis stood in the first run, by its last direction; band: ± 2 standard uncertainties",
        )
        axes.set_xlabel(axis_name)
        axes.set_ylabel(value_name)
    return figure


def _in_order(at: Array, size: Array, half: Array) -> tuple[Array, Array, Array]:
    order = np.argsort(at, kind="stable")
    return at[order], size[order], half[order]
