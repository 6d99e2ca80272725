"""Draws one parameter over the dates, and several selections of runs side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure

from monitor.exceptions import DataError
from monitor.reporting.figures.style import (
    caption,
    legend_above,
    new_figure,
    reference_line,
    style,
    zero_line,
)
from monitor.reporting.palette import BLUE, INK, MID, ORANGE, PAGE_WIDTH_MM, PALE


@dataclass(frozen=True)
class RunsOverTime:
    """Runs (n,) of one parameter: ``values`` ± ``expanded`` in ``unit`` over ``days`` since 1970."""

    days: npt.ArrayLike
    values: npt.ArrayLike
    expanded: npt.ArrayLike
    unit: str


def parameter_over_time(
    runs: RunsOverTime,
    *,
    title: str,
    line: tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike] | None = None,
    limit: float | None = None,
    changes: Sequence[float] = (),
    events: Mapping[float, str] | None = None,
) -> Figure:
    """Draw the runs of one parameter over time.

    ``line`` is the drift and its band: days, level and half-width (m,) each; ``limit`` that of the absolute value;
    ``changes`` and ``events`` (day to text) are upright lines. Raises DataError for arrays of unequal length.
    """
    t, y, half = (np.asarray(array, dtype=np.float64) for array in (runs.days, runs.values, runs.expanded))
    if not t.shape == y.shape == half.shape or t.ndim != 1 or not len(t):
        raise DataError(f"days, values and expanded must be as long, not {t.shape}, {y.shape}, {half.shape}")
    with style():
        figure = new_figure(PAGE_WIDTH_MM, 80.0, title)
        axes = figure.subplots()
        axes.errorbar(
            t, y, yerr=half, fmt="o", color=BLUE, markersize=2.6, elinewidth=0.7, label="runs, ± 2 u", zorder=2
        )  # fmt: skip
        if line is not None:
            at, level, width = (np.asarray(array, dtype=np.float64) for array in line)
            axes.plot(at, level, color=ORANGE, linewidth=1.4, label="drift since the last change", zorder=3)
            axes.fill_between(at, level - width, level + width, color=PALE, linewidth=0, zorder=1)
        # What happened long before or after would press the runs into a line.
        begin, end = axes.get_xlim()
        axes.set_xlim(begin, end)
        _changes_and_events(
            axes, changes, {day: text for day, text in (events or {}).items() if begin <= day <= end}
        )
        for side in () if limit is None else (-limit, limit):
            reference_line(axes, side)
        # Days since 1970 are what matplotlib counts its dates in.
        locator = AutoDateLocator(minticks=3, maxticks=8)  # type: ignore[no-untyped-call]
        axes.xaxis.set_major_locator(locator)
        axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))  # type: ignore[no-untyped-call]
        axes.set_ylabel(runs.unit, labelpad=2)
        axes.grid(axis="y", color=MID, linewidth=0.25, alpha=0.5)
        legend_above(axes)
        legend = ["grey: 95 % band of the drift"] if line is not None else []
        legend += ["dashed across: the limits of the absolute value"] if limit is not None else []
        if legend:
            caption(figure, "; ".join(legend))
    return figure


def _changes_and_events(axes: Axes, changes: Sequence[float], events: Mapping[float, str]) -> None:
    """Draw upright lines; the first of each kind is named in the legend."""
    for number, day in enumerate(changes):
        axes.axvline(
            day,
            color=ORANGE,
            linewidth=1.1,
            linestyle=(0, (4, 2)),
            label="change found" if number == 0 else None,
        )
    for number, (day, text) in enumerate(events.items()):
        axes.axvline(day, color=INK, linewidth=0.8, label="event recorded" if number == 0 else None)
        axes.annotate(
            text, (day, 1.0), xycoords=("data", "axes fraction"), xytext=(2, -2), textcoords="offset points",
            rotation=90, va="top", fontsize=6, color=INK, zorder=4,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.85},
        )  # fmt: skip


#: Names of parameters that fit beside each other slanted; more stand upright.
MANY_NAMES = 26


def selections_side_by_side(
    names: Sequence[str],
    units: Sequence[str],
    selections: Sequence[str],
    expanded: npt.ArrayLike,
    *,
    title: str,
    meaning: str,
) -> Figure:
    """Draw expanded uncertainties (selections, parameters) of selections of runs as bars, a panel a unit.

    After Los 2017, Figure 4.6. ``meaning`` says what the bars are. NaN leaves a bar out.
    """
    values = np.asarray(expanded, dtype=np.float64)
    if values.shape != (len(selections), len(names)):
        raise DataError(f"expanded must be ({len(selections)}, {len(names)}), not {values.shape}")
    kinds = list(dict.fromkeys(units))
    members = [[index for index, unit in enumerate(units) if unit == kind] for kind in kinds]
    width = 0.8 / max(len(selections), 1)
    upright = {"rotation": 60} if len(names) <= MANY_NAMES else {"rotation": 90, "fontsize": 5.5}
    shades = (BLUE, ORANGE, MID, INK, PALE)
    with style():
        figure = new_figure(PAGE_WIDTH_MM, 78.0, title)
        panels = figure.subplots(
            1, len(kinds), squeeze=False, width_ratios=[len(part) + 0.5 for part in members]
        )[0]
        for axes, kind, part in zip(panels, kinds, members, strict=True):
            zero_line(axes)
            for row, name in enumerate(selections):
                axes.bar(
                    np.arange(len(part)) + (row - (len(selections) - 1) / 2.0) * width, values[row, part], width * 0.92,
                    color=shades[row % len(shades)], edgecolor=INK, linewidth=0.3, label=name,
                    hatch=("", "///", "...", "xxx")[row % 4],
                )  # fmt: skip
            axes.set_xticks(np.arange(len(part)), [names[index] for index in part], **upright)
            axes.set_ylabel(kind, labelpad=2)
            axes.grid(axis="y", color=MID, linewidth=0.25, alpha=0.5)
        legend_above(panels[-1])
        caption(figure, meaning)
    return figure
