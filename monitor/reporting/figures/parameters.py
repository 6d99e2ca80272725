"""Figure of the parameters: every run of a campaign by day."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.figures.style import caption, new_figure, style
from monitor.reporting.palette import BLUE, FAINT, INK, MID, ORANGE, PAGE_WIDTH_MM


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
