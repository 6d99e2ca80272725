"""The shape of a workpiece: what was read at every angle of the table, and what was identified, magnified."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.figures.style import caption, new_figure, style
from monitor.reporting.palette import BLUE, INK, MID, ORANGE, PAGE_WIDTH_MM, PALE

#: The largest deviation is drawn as this part of the workpiece's longest edge.
_LONGEST = 0.12


def raw_and_identified(
    places: Array,
    normals: Array,
    raw_um: Array,
    angles: Sequence[float],
    shape_um: Array,
    expanded_um: Array,
    *,
    title: str = "",
    axes_names: tuple[str, str] = ("X", "Y"),
    width_mm: float = PAGE_WIDTH_MM,
    height_mm: float = 104.0,
) -> Figure:
    """Deviations along the normal at m points: raw at every angle beside the identified shape.

    ``places`` (m, 2) mm, ``normals`` (m, 2), ``raw_um`` (m, A) at the A ``angles`` (NaN where not probed), ``shape_um``
    and ``expanded_um`` (m,), NaN where there is no number. Both panels have the same magnification.
    """
    if raw_um.shape != (len(places), len(angles)) or shape_um.shape != (len(places),):
        raise DataError(
            f"{len(places)} points and {len(angles)} angles do not fit raw readings {raw_um.shape}"
        )
    extent = float(np.ptp(places, axis=0).max())
    largest = float(np.nanmax(np.abs(np.concatenate([raw_um.ravel(), shape_um, [1e-3]]))))
    magnified = _LONGEST * extent / largest
    with style():
        figure = new_figure(width_mm, height_mm, title)
        left, right = figure.subplots(1, 2, sharex=True, sharey=True)
        for axes in (left, right):
            axes.plot(*places.T, ".", color=MID, markersize=1.5, zorder=1)
            axes.set_aspect("equal")
            axes.set_xlabel(f"{axes_names[0]} / mm")
        left.set_ylabel(f"{axes_names[1]} / mm")
        others = ", grey: other angles" if len(angles) > 1 else ""
        left.set_title(f"raw (blue: {angles[0]:g}°{others})")
        right.set_title("identified, with its expanded uncertainty")
        for place in reversed(range(len(angles))):
            first = place == 0
            at = places + magnified * raw_um[:, place, None] * normals
            left.plot(
                *at.T, "o" if first else "x", color=BLUE if first else PALE, markersize=2.6 if first else 2.2,
                markerfacecolor="none", markeredgewidth=0.7, zorder=3 if first else 2,
            )  # fmt: skip
        at = places + magnified * shape_um[:, None] * normals
        reach = magnified * expanded_um[:, None] * normals
        for point, half in zip(at, reach, strict=True):
            if np.all(np.isfinite(point)) and np.all(np.isfinite(half)):
                right.plot(*np.column_stack([point - half, point + half]), color=MID, linewidth=0.8, zorder=2)
        right.plot(*at.T, "D", color=ORANGE, markersize=2.2, zorder=3)
        _scale(right, places, magnified, largest)
        caption(
            figure,
            "Grey dots: nominal points. Deviations are drawn along the surface's normal, magnified "
            f"{1000.0 * magnified:.0f} times; bars: U, k = 2.",
        )
    return figure


def _scale(axes: Axes, places: Array, magnified: float, largest_um: float) -> None:
    """A bar of a round length that says how long an error is drawn."""
    length = 10.0 ** np.floor(np.log10(largest_um))
    length *= max(step for step in (1.0, 2.0, 5.0) if step * length <= largest_um)
    x, y = places[:, 0].max(), places[:, 1].max()
    axes.plot([x - magnified * length, x], [y, y], color=INK, linewidth=1.6, zorder=4)
    axes.annotate(f"{length:g} µm", (x, y), (0, 3), textcoords="offset points", ha="right", fontsize=6.5)
