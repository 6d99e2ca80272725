"""Figures of the parameters: one result with its intervals, and every run of a campaign by day."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.figure_style import (
    BLUE,
    FAINT,
    INK,
    MID,
    ORANGE,
    PAGE_WIDTH_MM,
    caption,
    new_figure,
    style,
    zero_line,
)
from monitor.reporting.figure_style import decimal_sign as set_decimal_sign

_ROW_MM = 3.9


def parameter_intervals(
    names: Sequence[str],
    units: Sequence[str],
    estimate: npt.ArrayLike,
    expanded: npt.ArrayLike,
    *,
    title: str = "",
    tolerances: npt.ArrayLike | None = None,
    width_mm: float = PAGE_WIDTH_MM / 2,
    decimal_sign: str = ".",
) -> Figure:
    """Estimates (m,) with intervals of half-width ``expanded`` (m,), one panel a unit.

    ``tolerances`` (m,) are limits of absolute values, drawn as brackets; NaN where there is none.
    """
    values = _array(estimate, (len(names),), "estimate")
    half = _array(expanded, (len(names),), "expanded")
    limits = np.full(len(names), np.nan) if tolerances is None else np.asarray(tolerances, dtype=np.float64)
    kinds = list(dict.fromkeys(units))
    members = [[place for place, unit in enumerate(units) if unit == kind] for kind in kinds]
    height = sum(len(part) * _ROW_MM + 9.5 for part in members) + (7.0 if title else 0.0)
    with style():
        figure = new_figure(width_mm, height, title)
        panels = figure.subplots(
            len(kinds), 1, squeeze=False, height_ratios=[len(part) + 0.8 for part in members]
        )[:, 0]
        for axes, kind, part in zip(panels, kinds, members, strict=True):
            rows = np.arange(len(part))
            zero_line(axes, vertical=True)
            axes.errorbar(
                values[part],
                rows,
                xerr=half[part],
                fmt="o",
                color=BLUE,
                markersize=3.2,
                elinewidth=1.4,
                capsize=2,
            )
            for row, place in zip(rows, part, strict=True):
                for limit in (-limits[place], limits[place]):
                    if math.isfinite(limit):
                        axes.plot([limit, limit], [row - 0.35, row + 0.35], color=INK, linewidth=1.2)
            axes.set_yticks(rows, [names[place] for place in part])
            axes.set_ylim(len(part) - 0.4, -0.6)
            axes.tick_params(axis="y", length=0)
            axes.set_xlabel(kind, labelpad=1)
            axes.spines["left"].set_visible(False)
            axes.grid(axis="y", color=FAINT, linewidth=3.0)
            axes.margins(x=0.06)
            set_decimal_sign(axes, decimal_sign)
    return figure


def parameters_by_run(
    runs: npt.ArrayLike,
    days: npt.ArrayLike,
    names: Sequence[str],
    units: Sequence[str],
    estimate: npt.ArrayLike,
    expanded: npt.ArrayLike,
    *,
    title: str,
    interval: str,
    highlight: Sequence[str] = (),
    columns: int | None = None,
) -> Figure:
    """Small panels, one a parameter: ``estimate`` (n, m) over ``runs`` (n,), days (n,) as bands with their means.

    ``interval`` says what the half-widths ``expanded`` (n, m) are. Runs without a number (NaN) are left out.
    ``highlight`` names the parameters that the title speaks of.
    """
    run, day = np.asarray(runs), np.asarray(days)
    shape = (len(run), len(names))
    values, half = _array(estimate, shape, "estimate"), _array(expanded, shape, "expanded")
    across = columns or (1 if len(names) == 1 else 2 if len(names) <= 4 else 3)
    down = math.ceil(len(names) / across)
    with style():
        figure = new_figure(PAGE_WIDTH_MM, 18.0 + down * (34.0 if across > 1 else 62.0), title)
        grid = figure.subplots(down, across, squeeze=False, sharex=True)
        for place, axes in enumerate(grid.flat):
            if place >= len(names):
                axes.set_visible(False)
                continue
            chosen = names[place] in highlight
            _panel(axes, run, day, values[:, place], half[:, place], chosen)
            axes.set_title(names[place], pad=9, color=ORANGE if chosen else INK)
            axes.set_ylabel(units[place], labelpad=2)
            if place + across >= len(names):
                axes.tick_params(labelbottom=True)
            if place >= (down - 1) * across:
                axes.set_xlabel("run", labelpad=1)
        caption(figure, f"dots: runs with {interval}; black bars: means of the days")
    return figure


def _panel(
    axes: Axes,
    run: npt.NDArray[np.int64],
    day: npt.NDArray[np.int64],
    values: Array,
    half: Array,
    chosen: bool,
) -> None:
    colour = ORANGE if chosen else BLUE
    present = np.isfinite(values)
    position = np.arange(len(run))
    for count, label in enumerate(dict.fromkeys(day.tolist())):
        inside = np.flatnonzero(day == label)
        left, right = inside[0] - 0.5, inside[-1] + 0.5
        if count % 2 == 0:
            axes.axvspan(left, right, color=FAINT, linewidth=0, zorder=0)
        axes.annotate(
            f"day {label}" if count == 0 else f"{label}",
            ((left + right) / 2, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 1.5),
            textcoords="offset points",
            ha="center",
            fontsize=6,
            color=INK,
        )
        if np.any(present[inside]):
            mean = float(np.mean(values[inside][present[inside]]))
            axes.plot([left + 0.15, right - 0.15], [mean, mean], color=INK, linewidth=1.5, zorder=2)
    axes.errorbar(
        position[present],
        values[present],
        yerr=half[present],
        fmt="s" if chosen else "o",
        color=colour,
        markersize=2.8,
        elinewidth=0.9,
        zorder=3,
    )
    step = max(1, math.ceil(len(run) / 6))
    axes.set_xticks(position[::step], [str(number) for number in run[::step]])
    axes.set_xlim(-0.6, len(run) - 0.4)
    axes.yaxis.get_major_locator().set_params(nbins=5)  # type: ignore[call-arg]
    axes.grid(axis="y", color=MID, linewidth=0.25, alpha=0.5)


def _array(values: npt.ArrayLike, shape: tuple[int, ...], what: str) -> Array:
    array = np.asarray(values, dtype=np.float64)
    if array.shape != shape:
        raise DataError(f"{what} must have shape {shape}, but has {array.shape}")
    return array
