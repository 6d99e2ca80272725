"""Draws the residuals of a model: by group and over the workspace."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.figures.style import caption, new_figure, reference_line, style
from monitor.reporting.palette import BLUE, INK, ORANGE, PAGE_WIDTH_MM, PALE
from monitor.reporting.texts import texts_of

#: A residual's arrow: the longest is this part of the workspace's longest edge.
_LONGEST_ARROW = 0.2
#: So far from the middle a view reaches, in parts of that edge: half of it, and the longest arrow outwards.
_REACH = 0.5 + 1.1 * _LONGEST_ARROW
#: The edge in mm of the view of a single pose, which has none.
_LONE_EDGE_MM = 1.0


#: Part of a figure that each of its panels has at least, so that its words have room.
_LEAST_SHARE = 0.14


def residual_bars(
    groups: Mapping[str, tuple[Sequence[str], npt.ArrayLike]],
    *,
    level_um: float | None = None,
    level_name: str = "probe",
    title: str = "",
    width_mm: float = PAGE_WIDTH_MM,
    height_mm: float = 62.0,
) -> Figure:
    """Draw RMS residuals in µm as bars, one panel a grouping: ``{"target": (labels, rms_um), ...}``.

    ``level_um`` is the probe's repeatability or stated uncertainty, drawn as a line named ``level_name``.
    Bars above twice the level are marked.
    """
    if not groups:
        raise DataError("groups is empty; a grouping such as 'target' with its labels and RMS is needed")
    bars = {kind: (list(labels), _rms(kind, labels, rms)) for kind, (labels, rms) in groups.items()}
    say = texts_of()
    limit = math.inf if level_um is None else 2.0 * level_um
    shares, printed = _layout([labels for labels, _ in bars.values()], width_mm)
    lines = max(name.count("\n") for names in printed for name in names)
    with style():
        figure = new_figure(width_mm, height_mm + 3.4 * lines, title)
        panels = figure.subplots(1, len(bars), squeeze=False, sharey=True, width_ratios=shares)[0]
        for axes, names, (kind, (labels, rms)) in zip(panels, printed, bars.items(), strict=True):
            _bars(axes, rms, rms > limit)
            _name_bars(axes, names)
            axes.set_xlabel(say("figures.by", kind=kind), labelpad=2)
            axes.margins(x=0.02 if len(labels) > 8 else 0.08)
        if level_um is not None:
            hatched = any(bool(np.any(rms > limit)) for _, rms in bars.values())
            _draw_level(figure, panels, level_um, level_name, hatched=hatched)
        panels[0].set_ylabel(say("figures.residual_axis"))
        top = max(float(np.nanmax(rms)) for _, rms in bars.values())
        panels[0].set_ylim(0.0, 1.18 * max(top, level_um or 0.0) or 1.0)
    return figure


def _layout(labels_of_panels: Sequence[list[str]], width_mm: float) -> tuple[list[float], list[list[str]]]:
    """Return the shares of the width that the panels have, and what stands under the bars of each."""
    total = sum(map(len, labels_of_panels))
    shares = [max(len(labels), 3, _LEAST_SHARE * total) for labels in labels_of_panels]
    panels_mm = [0.88 * width_mm * share / sum(shares) for share in shares]
    return shares, [
        _labelled(labels, panel_mm) for labels, panel_mm in zip(labels_of_panels, panels_mm, strict=True)
    ]


def _name_bars(axes: Axes, names: Sequence[str]) -> None:
    """Write the names that have room under their bars, and draw the grid behind them."""
    shown = [index for index, name in enumerate(names) if name]
    axes.set_xticks(shown, [names[index] for index in shown])
    axes.grid(axis="y", color=PALE, linewidth=0.4)


def _draw_level(
    figure: Figure, panels: Sequence[Axes], level_um: float, level_name: str, *, hatched: bool
) -> None:
    """Draw the level in every panel, and say below what is dashed, and what is ``hatched`` where a bar is."""
    for axes in panels:
        reference_line(axes, level_um)
    say = texts_of()
    dashed = say("figures.dashed", name=level_name, level=f"{level_um:.2g}")
    caption(figure, dashed + (say("figures.hatched") if hatched else ""))


def _rms(kind: str, labels: Sequence[str], rms: npt.ArrayLike) -> Array:
    values = np.asarray(rms, dtype=np.float64)
    if values.shape != (len(labels),):
        raise DataError(f"the RMS by {kind} must have shape ({len(labels)},), but has {values.shape}")
    return values


def _bars(axes: Axes, rms: Array, marked: npt.NDArray[np.bool_]) -> None:
    """Draw bars; those that are ``marked`` are hatched, in the accent colour."""
    colours = [ORANGE if mark else BLUE for mark in marked]
    bars = axes.bar(np.arange(len(rms)), rms, width=0.66, color=colours, zorder=2)
    for bar, mark in zip(bars, marked, strict=True):
        bar.set_hatch("////" if mark else "")
        bar.set_edgecolor("white" if mark else BLUE)
        bar.set_linewidth(0.0)


def _labelled(labels: list[str], panel_mm: float) -> list[str]:
    """Return what stands under each bar of a panel so wide, "" under those that have no room; a letter takes 1.5 mm.

    Long names are broken into lines instead where they are few, or have places to break at.
    """
    longest = max(map(len, labels), default=1)
    letters = int(panel_mm / max(len(labels), 1) / 1.5) - 1
    if longest > letters:
        broken = [
            textwrap.fill(label, max(letters, 5), break_long_words=len(labels) <= 4) for label in labels
        ]
        if len(labels) <= 4 or _has_room(broken, letters):
            return broken
    step = max(1, math.ceil(len(labels) * (longest + 1.0) * 1.5 / panel_mm))
    return [label if index % step == 0 else "" for index, label in enumerate(labels)]


def _has_room(broken: Sequence[str], letters: int) -> bool:
    """Whether names broken into lines have at most three, each of so many letters at most."""
    lines = [name.split("\n") for name in broken]
    return all(len(of_name) <= 3 and max(map(len, of_name)) <= letters for of_name in lines)


@dataclass(frozen=True)
class View:
    """The view of residual vectors (n, 3): ``magnify`` times enlarged, within ``reach`` mm of the ``middle`` (3,).

    ``large`` (n,) marks the largest tenth, ``key`` is the length in µm of the bar that explains the arrows.
    """

    magnify: float
    middle: Array
    reach: float
    large: npt.NDArray[np.bool_]
    longest: float
    key: float


def view_of(positions: Array, residuals: Array) -> View:
    """Return the view of residuals (n, 3) µm at positions (n, 3) mm, one scale for all three sides."""
    length = np.linalg.norm(residuals, axis=1)
    extent = float(np.max(np.ptp(positions, axis=0))) or _LONE_EDGE_MM
    longest = float(np.max(length))
    return View(
        magnify=nice(_LONGEST_ARROW * extent / (longest * 1e-3)) if longest > 0.0 else 1.0,
        middle=(np.max(positions, axis=0) + np.min(positions, axis=0)) / 2,
        reach=_REACH * extent,
        large=length >= np.quantile(length, 0.9),
        longest=longest,
        key=nice(longest) if longest > 0.0 else 1.0,
    )


def residual_vectors(
    positions_mm: npt.ArrayLike, residuals_um: npt.ArrayLike, *, title: str, frame: str = "machine frame"
) -> Figure:
    """Draw residuals (n, 3) µm as magnified arrows at ``positions_mm`` (n, 3), in views along Z, Y and X.

    The largest tenth is drawn in the accent colour, thicker. All three views share one magnification, printed below.
    """
    positions, residuals = _points(positions_mm, residuals_um)
    view = view_of(positions, residuals)
    large, magnify, middle, reach = view.large, view.magnify, view.middle, view.reach
    with style():
        figure = new_figure(PAGE_WIDTH_MM, 71.0, title)
        panels = figure.subplots(1, 3)
        for axes, (across, up) in zip(panels, ((0, 1), (0, 2), (1, 2)), strict=True):
            axes.scatter(positions[:, across], positions[:, up], s=3, color=PALE, linewidths=0, zorder=1)
            for rows, colour, width in ((~large, BLUE, 0.005), (large, ORANGE, 0.0095)):
                axes.quiver(
                    positions[rows, across],
                    positions[rows, up],
                    residuals[rows, across] * 1e-3 * magnify,
                    residuals[rows, up] * 1e-3 * magnify,
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


def _points(positions_mm: npt.ArrayLike, residuals_um: npt.ArrayLike) -> tuple[Array, Array]:
    positions = np.asarray(positions_mm, dtype=np.float64)
    residuals = np.asarray(residuals_um, dtype=np.float64)
    shapes = positions.shape, residuals.shape
    if positions.ndim != 2 or shapes[0] != shapes[1] or shapes[0][1] != 3 or not len(positions):
        raise DataError(
            f"positions_mm and residuals_um must have one shape (n, 3), but have {shapes[0]} and {shapes[1]}"
        )
    return positions, residuals


def nice(value: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that does not exceed ``value``."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value * (1.0 + 1e-9))
