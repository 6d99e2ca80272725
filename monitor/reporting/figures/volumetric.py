"""Draws the volumetric error in slices through the workspace, with its uncertainty; expected uncertainties."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure

from monitor.exceptions import DataError
from monitor.reporting.figures.style import caption, new_figure, style
from monitor.reporting.palette import BLUE, INK, MID, ORANGE, PAGE_WIDTH_MM
from monitor.reporting.svg.map_slices import Slice, slices_of

#: From paper to blue: the darker, the larger, in grey too.
_LENGTHS = LinearSegmentedColormap.from_list("lengths", ["#ffffff", "#8fb0cf", BLUE])


def volumetric_slices(
    readings_mm: npt.ArrayLike,
    vectors_um: npt.ArrayLike,
    expanded_um: npt.ArrayLike,
    *,
    names: Sequence[str],
    title: str,
    note: str = "",
) -> Figure:
    """Draw three slices through the middle of a regular grid of points (n, 3), one across each axis.

    ``vectors_um`` (n, 3) is the error along the machine's axes, ``expanded_um`` (n,) the expanded uncertainty of its
    length. Colour is the length of the error, arrows are its part in the slice. Raises DataError for what is no grid.
    """
    slices = slices_of(readings_mm, vectors_um, expanded_um, names)
    longest = float(np.linalg.norm(np.asarray(vectors_um, dtype=np.float64), axis=1).max())
    scale = Normalize(0.0, longest if longest > 0.0 else 1.0)
    with style():
        figure = new_figure(PAGE_WIDTH_MM, 86.0 if title else 62.0, title)
        panels = figure.subplots(1, 3)
        for part, axes in zip(slices, panels, strict=True):
            _slice(axes, part, scale)
        colours = figure.colorbar(panels[0].collections[0], ax=list(panels), shrink=0.8, aspect=24, pad=0.015)
        colours.set_label("length of the error / µm")
        colours.outline.set_linewidth(0.4)
        if note:
            caption(figure, note)
    return figure


def _slice(axes: Axes, part: Slice, scale: Normalize) -> None:
    first, second = np.array(part.first_mm), np.array(part.second_mm)
    axes.pcolormesh(
        first,
        second,
        np.array(part.lengths_um).T,
        cmap=_LENGTHS,
        norm=scale,
        shading="gouraud",
        rasterized=True,
    )
    x, y = np.meshgrid(first, second, indexing="ij")
    length = 0.16 * max(np.ptp(first), np.ptp(second)) / float(scale.vmax or 1.0)
    axes.quiver(
        x, y, np.array(part.first_um) * length, np.array(part.second_um) * length, angles="xy", scale_units="xy",
        scale=1.0, color=INK, width=0.006, zorder=4,
    )  # fmt: skip
    # Numbers stand at the corners and the middle of a grid of three, below their nodes: some 5 mm of 45 mm.
    longer = float(max(np.ptp(first), np.ptp(second)))
    picks = [
        np.unique(np.linspace(0, len(level) - 1, 3 if np.ptp(level) > 0.25 * longer else 2).astype(int))
        for level in (first, second)
    ]
    for i in picks[0]:
        for j in picks[1]:
            axes.annotate(
                f"±{part.expanded_um[i][j]:.1f}", (first[i], second[j]),
                xytext=(0, -7), textcoords="offset points", ha="center", va="top", fontsize=5.5, color=INK, zorder=5,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.4},
            )  # fmt: skip
    room = [0.18 * float(np.ptp(first)), max(0.18 * float(np.ptp(second)), 0.11 * longer)]
    axes.set_xlim(float(first[0]) - room[0], float(first[-1]) + room[0])
    axes.set_ylim(float(second[0]) - room[1], float(second[-1]) + room[1])
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel(f"{part.along[0]} / mm", labelpad=1)
    axes.set_ylabel(f"{part.along[1]} / mm", labelpad=1)
    axes.set_title(f"{part.across} = {round(part.at_mm) + 0.0:.0f} mm")


def expected_uncertainties(
    names: Sequence[str],
    units: Sequence[str],
    present: npt.ArrayLike,
    proposed: npt.ArrayLike | None,
    *,
    title: str,
    note: str = "",
) -> Figure:
    """Draw expected standard uncertainties (k,) of a plan, and of another beside it; NaN where there is no number."""
    before = np.asarray(present, dtype=np.float64)
    after = None if proposed is None else np.asarray(proposed, dtype=np.float64)
    if (
        before.shape != (len(names),)
        or len(units) != len(names)
        or (after is not None and after.shape != before.shape)
    ):
        raise DataError(f"{len(names)} parameters need as many units and uncertainties")
    at = np.arange(len(names), dtype=np.float64)
    # Letters of 6 pt: some 115 stand side by side.
    upright = len(names) * (max(map(len, names)) + 1) > 115
    with style():
        figure = new_figure(PAGE_WIDTH_MM, 96.0 if upright else 70.0, title)
        axes = figure.subplots()
        axes.plot(
            at - (0.12 if after is not None else 0.0),
            before,
            "o",
            color=BLUE,
            markersize=5,
            label="present plan",
        )
        if after is not None:
            axes.plot(
                at + 0.12, after, "s", color=ORANGE, markerfacecolor="white", markeredgewidth=1.4, markersize=5,
                label="proposed plan",
            )  # fmt: skip
            axes.vlines(at, 0.0, np.nanmax([before, after]), color=MID, linewidth=0.2, zorder=0)
            axes.legend(loc="upper left", ncols=2, fontsize=7)
        between = " / " if upright else "\n"
        axes.set_xticks(
            at,
            [f"{name}{between}{unit}" for name, unit in zip(names, units, strict=True)],
            rotation=90 if upright else 0,
            fontsize=6,
        )
        axes.set_ylim(
            0.0, 1.2 * float(np.nanmax(np.concatenate([before, [] if after is None else after, [1e-9]])))
        )
        axes.set_ylabel("expected standard uncertainty")
        if note:
            caption(figure, note)
    return figure
