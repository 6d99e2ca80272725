"""Figures of what the model leaves: by group and over the workspace."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.figures.style import caption, new_figure, reference_line, style
from monitor.reporting.palette import BLUE, INK, ORANGE, PAGE_WIDTH_MM, PALE
from monitor.reporting.texts import texts_of

#: A residual's arrow: the longest is this part of the workspace's longest edge.
_LONGEST_ARROW = 0.2


def residual_bars(
    groups: Mapping[str, tuple[Sequence[str], npt.ArrayLike]],
    *,
    level_um: float | None = None,
    level_name: str = "probe",
    title: str = "",
    width_mm: float = PAGE_WIDTH_MM,
    height_mm: float = 62.0,
) -> Figure:
    """RMS residuals in µm as bars, one panel a grouping: ``{"target": (labels, rms_um), ...}``.

    ``level_um`` is the probe's repeatability or stated uncertainty, drawn as a line named ``level_name``.
    Bars above twice the level are marked.
    """
    if not groups:
        raise DataError("groups is empty; a grouping such as 'target' with its labels and RMS is needed")
    counts = [max(len(labels), 3) for labels, _ in groups.values()]
    say = texts_of()
    with style():
        figure = new_figure(width_mm, height_mm, title)
        marked = False
        panels = figure.subplots(1, len(groups), squeeze=False, sharey=True, width_ratios=counts)[0]
        for axes, (kind, (labels, rms)) in zip(panels, groups.items(), strict=True):
            values = np.asarray(rms, dtype=np.float64)
            if values.shape != (len(labels),):
                raise DataError(f"the RMS by {kind} must have shape ({len(labels)},), but has {values.shape}")
            high = np.zeros(len(values), dtype=bool) if level_um is None else values > 2.0 * level_um
            bars = axes.bar(
                np.arange(len(labels)),
                values,
                width=0.66,
                color=[ORANGE if mark else BLUE for mark in high],
                zorder=2,
            )
            for bar, mark in zip(bars, high, strict=True):
                bar.set_hatch("////" if mark else "")
                bar.set_edgecolor("white" if mark else BLUE)
                bar.set_linewidth(0.0)
            # Thirty short labels fit across a page; long ones take their width, some 1.5 mm a letter.
            room = min(1.0, 5.7 / (1.5 + 1.5 * max(map(len, labels), default=1)))
            fitting = 30 * len(labels) / sum(counts) * width_mm / PAGE_WIDTH_MM * room
            step = max(1, math.ceil(len(labels) / max(2 if room < 1.0 else 4, fitting)))
            axes.set_xticks(np.arange(len(labels))[::step], list(labels)[::step])
            axes.set_xlabel(say("figures.by", kind=kind), labelpad=2)
            axes.grid(axis="y", color=PALE, linewidth=0.4)
            axes.margins(x=0.02 if len(labels) > 8 else 0.08)
            if level_um is not None:
                reference_line(axes, level_um)
            marked = marked or bool(np.any(high))
        if level_um is not None:
            more = say("figures.hatched") if marked else ""
            caption(figure, say("figures.dashed", name=level_name, level=f"{level_um:.2g}") + more)
        panels[0].set_ylabel(say("figures.residual_axis"))
        top = max(float(np.nanmax(np.asarray(rms, dtype=np.float64))) for _, rms in groups.values())
        panels[0].set_ylim(0.0, 1.18 * max(top, level_um or 0.0) or 1.0)
    return figure


@dataclass(frozen=True)
class View:
    """How residual vectors (n, 3) are drawn: ``magnify`` times enlarged, within ``reach`` mm of the ``middle`` (3,).

    ``large`` (n,) marks the largest tenth, ``key`` is the length in µm of the bar that explains the arrows.
    """

    magnify: float
    middle: Array
    reach: float
    large: npt.NDArray[np.bool_]
    longest: float
    key: float


def view_of(place: Array, size: Array) -> View:
    """The view of residuals (n, 3) µm at places (n, 3) mm, one scale for all three sides."""
    length = np.linalg.norm(size, axis=1)
    extent = float(np.max(np.ptp(place, axis=0)))
    longest = float(np.max(length))
    seen = longest > 0.0 and extent > 0.0
    return View(
        magnify=nice(_LONGEST_ARROW * extent / (longest * 1e-3)) if seen else 1.0,
        middle=(np.max(place, axis=0) + np.min(place, axis=0)) / 2,
        reach=0.66 * extent or 1.0,
        large=length >= np.quantile(length, 0.9),
        longest=longest,
        key=nice(longest) if longest > 0.0 else 1.0,
    )


def residual_vectors(
    positions_mm: npt.ArrayLike, residuals_um: npt.ArrayLike, *, title: str, frame: str = "machine frame"
) -> Figure:
    """Residuals (n, 3) µm as magnified arrows at ``positions_mm`` (n, 3), seen along Z, Y and X.

    The largest tenth is drawn in the accent colour, thicker. All three views share one magnification, printed below.
    """
    place, size = _points(positions_mm, residuals_um)
    view = view_of(place, size)
    large, magnify, middle, reach = view.large, view.magnify, view.middle, view.reach
    with style():
        figure = new_figure(PAGE_WIDTH_MM, 71.0, title)
        panels = figure.subplots(1, 3)
        for axes, (across, up) in zip(panels, ((0, 1), (0, 2), (1, 2)), strict=True):
            axes.scatter(place[:, across], place[:, up], s=3, color=PALE, linewidths=0, zorder=1)
            for chosen, colour, width in ((~large, BLUE, 0.005), (large, ORANGE, 0.0095)):
                axes.quiver(
                    place[chosen, across],
                    place[chosen, up],
                    size[chosen, across] * 1e-3 * magnify,
                    size[chosen, up] * 1e-3 * magnify,
                    angles="xy",
                    scale_units="xy",
                    scale=1.0,
                    color=colour,
                    width=width,
                    zorder=3 if colour == ORANGE else 2,
                )
            axes.set_xlim(middle[across] - reach, middle[across] + reach)
            axes.set_ylim(middle[up] - reach, middle[up] + reach)
            axes.set_aspect("equal")
            axes.set_title(f"{'XYZ'[across]}{'XYZ'[up]}")
            axes.set_xlabel(f"{'XYZ'[across]} / mm", labelpad=1)
            axes.set_ylabel(f"{'XYZ'[up]} / mm", labelpad=0)
        key = view.key
        corner = (middle[0] - 0.95 * reach, middle[1] - 0.9 * reach)
        panels[0].plot(
            [corner[0], corner[0] + key * 1e-3 * magnify], [corner[1]] * 2, color=INK, linewidth=2.2
        )
        panels[0].annotate(
            f"{key:g} µm",
            corner,
            xytext=(0, 3),
            textcoords="offset points",
            fontsize=7,
            va="bottom",
            zorder=5,
        )
        caption(
            figure, f"{frame}; arrows {magnify:g} times enlarged, bar {key:g} µm; thick: the largest tenth"
        )
    return figure


def _points(positions: npt.ArrayLike, residuals: npt.ArrayLike) -> tuple[Array, Array]:
    place, size = np.asarray(positions, dtype=np.float64), np.asarray(residuals, dtype=np.float64)
    if place.ndim != 2 or place.shape != size.shape or place.shape[1] != 3 or not len(place):
        raise DataError(
            f"positions_mm and residuals_um must have one shape (n, 3), but have {place.shape} and {size.shape}"
        )
    return place, size


def nice(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that does not exceed ``value``."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value * (1.0 + 1e-9))
