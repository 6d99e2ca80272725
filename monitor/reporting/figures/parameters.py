"""Draws the parameters of a campaign: every run, by day."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.figures.style import caption, new_figure, style
from monitor.reporting.palette import BLUE, FAINT, INK, MID, ORANGE, PAGE_WIDTH_MM


@dataclass(frozen=True)
class ParametersOfRuns:
    """Parameters (m,) with their ``estimate`` (n, m) in every run (n,) of a day (n,), NaN where there is no number.

    ``expanded`` (n, m) are half-widths of intervals.
    """

    runs: npt.ArrayLike
    days: npt.ArrayLike
    names: Sequence[str]
    units: Sequence[str]
    estimate: npt.ArrayLike
    expanded: npt.ArrayLike


#: Days named above a panel; of more, every second, third ... one.
DAYS_NAMED = 7


def parameters_by_run(
    parameters: ParametersOfRuns,
    *,
    title: str,
    interval: str,
    highlight: Sequence[str] = (),
    columns: int | None = None,
) -> Figure:
    """Draw small panels, one a parameter, over the runs, with days as bands and their means.

    ``interval`` says what the half-widths are; ``highlight`` names the parameters of which the title speaks.
    """
    run, day, names = np.asarray(parameters.runs), np.asarray(parameters.days), parameters.names
    shape = (len(run), len(names))
    values = _array(parameters.estimate, shape, "estimate")
    half = _array(parameters.expanded, shape, "expanded")
    across = columns or (1 if len(names) == 1 else 2 if len(names) <= 4 else 3)
    down = math.ceil(len(names) / across)
    with style():
        figure = new_figure(PAGE_WIDTH_MM, 18.0 + down * (34.0 if across > 1 else 62.0), title)
        grid = figure.subplots(down, across, squeeze=False, sharex=True)
        for index, axes in enumerate(grid.flat):
            if index >= len(names):
                axes.set_visible(False)
                continue
            highlighted = names[index] in highlight
            _panel(axes, run, day, values[:, index], half[:, index], highlighted)
            axes.set_title(names[index], pad=9, color=ORANGE if highlighted else INK)
            axes.set_ylabel(parameters.units[index], labelpad=2)
            if index + across >= len(names):
                axes.tick_params(labelbottom=True)
            if index >= (down - 1) * across:
                axes.set_xlabel("run", labelpad=1)
        caption(figure, f"dots: runs with {interval}; black bars: means of the days")
    return figure


def _panel(
    axes: Axes,
    run: npt.NDArray[np.int64],
    day: npt.NDArray[np.int64],
    values: Array,
    half: Array,
    highlighted: bool,
) -> None:
    colour = ORANGE if highlighted else BLUE
    present = np.isfinite(values)
    position = np.arange(len(run))
    days = list(dict.fromkeys(day.tolist()))
    named = max(1, math.ceil(len(days) / DAYS_NAMED))
    for count, label in enumerate(days):
        inside = np.flatnonzero(day == label)
        start, end = inside[0] - 0.5, inside[-1] + 0.5
        narrow = (
            count == 0 and named > 1
        )  # its words are wider than its band, and the power of ten stands left
        if count % 2 == 0:
            axes.axvspan(start, end, color=FAINT, linewidth=0, zorder=0)
        axes.annotate(
            "" if count % named else f"day {label}" if count == 0 else f"{label}",
            (start if narrow else (start + end) / 2, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 1.5),
            textcoords="offset points",
            ha="left" if narrow else "center",
            fontsize=6,
            color=INK,
        )
        if np.any(present[inside]):
            mean = float(np.mean(values[inside][present[inside]]))
            axes.plot([start + 0.15, end - 0.15], [mean, mean], color=INK, linewidth=1.5, zorder=2)
    axes.errorbar(
        position[present],
        values[present],
        yerr=half[present],
        fmt="s" if highlighted else "o",
        color=colour,
        markersize=2.8,
        elinewidth=0.9,
        zorder=3,
    )
    step = max(1, math.ceil(len(run) / 6))
    axes.set_xticks(position[::step], [str(number) for number in run[::step]])
    axes.set_xlim(-0.6, len(run) - 0.4)
    axes.yaxis.get_major_locator().set_params(nbins=5)  # type: ignore[call-arg]
    axes.yaxis.get_offset_text().set_horizontalalignment("right")  # the days stand right of it
    axes.grid(axis="y", color=MID, linewidth=0.25, alpha=0.5)


def _array(values: npt.ArrayLike, shape: tuple[int, ...], name: str) -> Array:
    array = np.asarray(values, dtype=np.float64)
    if array.shape != shape:
        raise DataError(f"{name} must have shape {shape}, but has {array.shape}")
    return array
