"""Draws the shape of a workpiece: as read at every angle of the table, and as identified, magnified."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.figures.style import caption, new_figure, style
from monitor.reporting.palette import BLUE, INK, MID, ORANGE, PAGE_WIDTH_MM, PALE

#: The largest deviation is drawn as this part of the workpiece's longest edge.
_LONGEST = 0.12


HEIGHT_MM = 104.0


@dataclass(frozen=True)
class Deviations:
    """Deviations along the normal at m points, at ``positions`` (m, 2) mm with ``normals`` (m, 2).

    ``raw_um`` (m, A) were read at the A ``angles``, NaN where a point was not probed. ``shape_um`` (m,) and its
    ``expanded_um`` (m,) were identified, NaN where there is no number.
    """

    positions: Array
    normals: Array
    raw_um: Array
    angles: Sequence[float]
    shape_um: Array
    expanded_um: Array


def raw_and_identified(
    deviations: Deviations, *, title: str = "", axes_names: tuple[str, str] = ("X", "Y")
) -> Figure:
    """Draw the raw deviations at every angle beside the identified shape, both with the same magnification."""
    positions, normals, angles = deviations.positions, deviations.normals, deviations.angles
    raw_um, shape_um = deviations.raw_um, deviations.shape_um
    if raw_um.shape != (len(positions), len(angles)) or shape_um.shape != (len(positions),):
        raise DataError(
            f"{len(positions)} points and {len(angles)} angles do not fit raw readings {raw_um.shape}"
        )
    extent = float(np.ptp(positions, axis=0).max())
    largest = float(np.nanmax(np.abs(np.concatenate([raw_um.ravel(), shape_um, [1e-3]]))))
    magnified = _LONGEST * extent / largest
    with style():
        figure = new_figure(PAGE_WIDTH_MM, HEIGHT_MM, title)
        raw, identified = figure.subplots(1, 2, sharex=True, sharey=True)
        for axes in (raw, identified):
            axes.plot(*positions.T, ".", color=MID, markersize=1.5, zorder=1)
            axes.set_aspect("equal")
            axes.set_xlabel(f"{axes_names[0]} / mm")
        raw.set_ylabel(f"{axes_names[1]} / mm")
        others = ", grey: other angles" if len(angles) > 1 else ""
        raw.set_title(f"raw (blue: {angles[0]:g}°{others})")
        identified.set_title("identified, with its expanded uncertainty")
        for index in reversed(range(len(angles))):
            first = index == 0
            at = positions + magnified * raw_um[:, index, None] * normals
            raw.plot(
                *at.T, "o" if first else "x", color=BLUE if first else PALE, markersize=2.6 if first else 2.2,
                markerfacecolor="none", markeredgewidth=0.7, zorder=3 if first else 2,
            )  # fmt: skip
        at = positions + magnified * shape_um[:, None] * normals
        reach = magnified * deviations.expanded_um[:, None] * normals
        for point, half in zip(at, reach, strict=True):
            if np.all(np.isfinite(point)) and np.all(np.isfinite(half)):
                identified.plot(
                    *np.column_stack([point - half, point + half]), color=MID, linewidth=0.8, zorder=2
                )
        identified.plot(*at.T, "D", color=ORANGE, markersize=2.2, zorder=3)
        _scale(identified, positions, magnified, largest)
        caption(
            figure,
            "Grey dots: nominal points. Deviations are drawn along the surface's normal, magnified "
            f"{1000.0 * magnified:.0f} times; bars: U, k = 2.",
        )
    return figure


def _scale(axes: Axes, positions: Array, magnified: float, largest_um: float) -> None:
    """Draw a bar of a round length as the scale of the errors."""
    length = 10.0 ** np.floor(np.log10(largest_um))
    length *= max(step for step in (1.0, 2.0, 5.0) if step * length <= largest_um)
    x, y = positions[:, 0].max(), positions[:, 1].max()
    axes.plot([x - magnified * length, x], [y, y], color=INK, linewidth=1.6, zorder=4)
    axes.annotate(f"{length:g} µm", (x, y), (0, 3), textcoords="offset points", ha="right", fontsize=6.5)
