"""Figures of the volumetric error: slices through the workspace, with its uncertainty; expected uncertainties."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.figure_style import (
    BLUE,
    INK,
    MID,
    ORANGE,
    PAGE_WIDTH_MM,
    caption,
    decimal_sign,
    new_figure,
    style,
)
from monitor.reporting.texts import Texts, texts_of

#: From paper to blue: the darker, the larger, in grey too.
_LENGTHS = LinearSegmentedColormap.from_list("lengths", ["#ffffff", "#8fb0cf", BLUE])
#: The same without colour, light enough for the arrows to stay visible.
_GREYS = LinearSegmentedColormap.from_list("greys", ["#ffffff", "#9a9a9a"])
#: Numbers are written at so many nodes of a slice, the corners and the middle of a grid of three.
_NUMBERS = 3


def volumetric_slices(
    readings_mm: npt.ArrayLike,
    vectors_um: npt.ArrayLike,
    expanded_um: npt.ArrayLike,
    *,
    names: Sequence[str],
    title: str,
    note: str = "",
    texts: Texts | None = None,
    grey: bool = False,
) -> Figure:
    """Three slices through the middle of a regular grid of points (n, 3), one across each axis.

    ``vectors_um`` (n, 3) is the error along the machine's axes, ``expanded_um`` (n,) the expanded uncertainty of its
    length. Colour is the length of the error (grey bands in a ``grey`` figure), arrows are its part in the slice. The
    words are those of ``texts``, English without.
    """
    places = np.asarray(readings_mm, dtype=np.float64)
    vectors = np.asarray(vectors_um, dtype=np.float64)
    expanded = np.asarray(expanded_um, dtype=np.float64)
    levels = [np.unique(np.round(places[:, axis], 6)) for axis in range(3)] if places.ndim == 2 else []
    shape = tuple(len(level) for level in levels)
    if places.shape != vectors.shape or expanded.shape != (len(places),) or len(names) != 3:
        raise DataError(
            f"a map needs points and vectors (n, 3), n uncertainties and 3 names, not {places.shape}, "
            f"{vectors.shape}, {expanded.shape} and {len(names)}"
        )
    if int(np.prod(shape)) != len(places) or min(shape) < 2:
        raise DataError(f"{len(places)} points are no grid of {shape[0]} x {shape[1]} x {shape[2]}")
    order = np.lexsort((places[:, 2], places[:, 1], places[:, 0]))
    cube = vectors[order].reshape(*shape, 3)
    spread = expanded[order].reshape(shape)
    lengths = np.linalg.norm(cube, axis=-1)
    longest = float(lengths.max())
    scale = Normalize(0.0, longest if longest > 0.0 else 1.0)
    say = texts or texts_of()
    bands = np.asarray(MaxNLocator(8).tick_values(0.0, float(scale.vmax or 1.0))) if grey else None
    look = _Look(_GREYS if grey else _LENGTHS, scale, say, bands)
    with style():
        figure = new_figure(PAGE_WIDTH_MM, 86.0 if title else 62.0, title)
        panels = figure.subplots(1, 3)
        for across, axes in zip((2, 1, 0), panels, strict=True):
            _slice(axes, across, levels, cube, lengths, spread, look, names)
        colours = figure.colorbar(panels[0].collections[0], ax=list(panels), shrink=0.8, aspect=24, pad=0.015)
        colours.set_label(say("figures.length"))
        decimal_sign(colours.ax, say.decimal_sign)
        colours.outline.set_linewidth(0.4)
        if note:
            caption(figure, note)
    return figure


@dataclass(frozen=True)
class _Look:
    """What all slices share: the colours of a length, their scale, the words.

    With ``bands`` lengths are drawn as areas between these: lines and areas only, since a picture smoothed by the
    reader (``/Interpolate``) has no place in PDF/A (ISO 19005-3:2012, 6.2.8).
    """

    colours: LinearSegmentedColormap
    scale: Normalize
    say: Texts
    bands: Array | None


def _slice(
    axes: Axes,
    across: int,
    levels: Sequence[Array],
    cube: Array,
    lengths: Array,
    spread: Array,
    look: _Look,
    names: Sequence[str],
) -> None:
    along = [axis for axis in range(3) if axis != across]
    middle = len(levels[across]) // 2
    first, second = (levels[axis] for axis in along)
    flat = np.take(lengths, middle, axis=across)
    part = np.take(cube, middle, axis=across)
    sure = np.take(spread, middle, axis=across)
    if look.bands is not None:
        axes.contourf(first, second, flat.T, levels=look.bands, cmap=look.colours)
    else:
        axes.pcolormesh(
            first, second, flat.T, cmap=look.colours, norm=look.scale, shading="gouraud", rasterized=True
        )
    x, y = np.meshgrid(first, second, indexing="ij")
    longest = float(np.abs(np.linalg.norm(cube, axis=-1)).max())
    length = 0.16 * max(np.ptp(first), np.ptp(second)) / (longest if longest > 0.0 else 1.0)
    axes.quiver(
        x, y, part[..., along[0]] * length, part[..., along[1]] * length, angles="xy", scale_units="xy",
        scale=1.0, color=INK, width=0.006, zorder=4,
    )  # fmt: skip
    picks = [np.unique(np.linspace(0, len(level) - 1, _NUMBERS).astype(int)) for level in (first, second)]
    for i in picks[0]:
        for j in picks[1]:
            number = f"±{sure[i, j]:.1f}".replace(".", look.say.decimal_sign)
            axes.annotate(
                number, (first[i], second[j]), xytext=(0, -7), textcoords="offset points",
                ha="center", va="top", fontsize=5.5, color=INK, zorder=5,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.4},
            )  # fmt: skip
    room = [0.18 * float(np.ptp(level)) for level in (first, second)]
    axes.set_xlim(float(first[0]) - room[0], float(first[-1]) + room[0])
    axes.set_ylim(float(second[0]) - room[1], float(second[-1]) + room[1])
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel(f"{names[along[0]]} / mm", labelpad=1)
    axes.set_ylabel(f"{names[along[1]]} / mm", labelpad=1)
    axes.set_title(f"{names[across]} = {levels[across][middle].round() + 0.0:.0f} mm")


def expected_uncertainties(
    names: Sequence[str],
    units: Sequence[str],
    present: npt.ArrayLike,
    proposed: npt.ArrayLike | None,
    *,
    title: str,
    note: str = "",
) -> Figure:
    """Expected standard uncertainties (k,) of a plan, and of another beside it; NaN where a plan gives no number."""
    now = np.asarray(present, dtype=np.float64)
    then = None if proposed is None else np.asarray(proposed, dtype=np.float64)
    if (
        now.shape != (len(names),)
        or len(units) != len(names)
        or (then is not None and then.shape != now.shape)
    ):
        raise DataError(f"{len(names)} parameters need as many units and uncertainties")
    at = np.arange(len(names), dtype=np.float64)
    with style():
        figure = new_figure(PAGE_WIDTH_MM, 70.0, title)
        axes = figure.subplots()
        axes.plot(
            at - (0.12 if then is not None else 0.0), now, "o", color=BLUE, markersize=5, label="present plan"
        )
        if then is not None:
            axes.plot(
                at + 0.12, then, "s", color=ORANGE, markerfacecolor="white", markeredgewidth=1.4, markersize=5,
                label="proposed plan",
            )  # fmt: skip
            axes.vlines(at, 0.0, np.nanmax([now, then]), color=MID, linewidth=0.2, zorder=0)
            axes.legend(loc="upper left", ncols=2, fontsize=7)
        axes.set_xticks(
            at, [f"{name}\n{unit}" for name, unit in zip(names, units, strict=True)], rotation=0, fontsize=6
        )
        axes.set_ylim(
            0.0, 1.2 * float(np.nanmax(np.concatenate([now, [] if then is None else then, [1e-9]])))
        )
        axes.set_ylabel("expected standard uncertainty")
        if note:
            caption(figure, note)
    return figure
