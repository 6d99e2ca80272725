"""Figures of the search for missing effects: the error falling model by model, and effects ranked in groups."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.figures.style import new_figure, reference_line, style
from monitor.reporting.palette import BLUE, INK, MID, ORANGE, PAGE_WIDTH_MM, PALE


@dataclass(frozen=True)
class ErrorSteps:
    """RMS residual in ``unit`` of every model version (s,), on the fitted and on held-out runs, and its floor.

    ``names`` says what each version added, the base model first. ``held_out`` is NaN where a version has no held-out
    error.
    """

    names: Sequence[str]
    rms: npt.ArrayLike
    held_out: npt.ArrayLike
    noise: float
    noise_name: str = "noise floor"
    unit: str = "µm"


#: Letters of the names of steps that fit on the page beside each other.
_LETTERS = 100


def error_falling(steps: ErrorSteps, *, title: str) -> Figure:
    """Draw the error of every model version; versions after the first get a plus."""
    fitted = np.asarray(steps.rms, dtype=np.float64)
    held_out = np.asarray(steps.held_out, dtype=np.float64)
    count, noise, unit = len(steps.names), steps.noise, steps.unit
    if not count or fitted.shape != (count,) or held_out.shape != (count,):
        raise DataError(
            f"{count} steps need rms_um and heldout_rms_um of shape ({count},), "
            f"not {fitted.shape} and {held_out.shape}"
        )
    at = np.arange(count, dtype=np.float64)
    with style():
        figure = new_figure(PAGE_WIDTH_MM, 82.0, title)
        axes = figure.subplots()
        axes.axhspan(0.0, noise, color=PALE, alpha=0.45, linewidth=0, zorder=0)
        reference_line(axes, noise)
        axes.text(-0.45, noise / 2, f"{steps.noise_name} {noise:.2g} {unit}", va="center", fontsize=7.5)
        axes.plot(
            at,
            held_out,
            "s--",
            color=ORANGE,
            markersize=5.5,
            markerfacecolor="white",
            markeredgewidth=1.4,
            zorder=4,
        )
        axes.plot(at, fitted, "o-", color=BLUE, markersize=5.5, zorder=5)
        _name_lines(axes, fitted, held_out)
        for index in range(count):
            axes.annotate(
                _at_height(fitted[index], unit),
                (index, fitted[index]),
                xytext=(0, -7),
                textcoords="offset points",
                ha="center",
                va="top",
                fontsize=7,
                color=BLUE,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.8},
                zorder=6,
            )
            if np.isfinite(held_out[index]):
                axes.annotate(
                    _at_height(held_out[index], unit),
                    (index, held_out[index]),
                    xytext=(0, 6),
                    textcoords="offset points",
                    ha="center",
                    fontsize=7,
                    color=INK,
                )
        room = max(6, int(_LETTERS / (count + 0.5)))
        axes.set_xticks(at, [_step_name(index, step, room) for index, step in enumerate(steps.names)])
        axes.set_xlim(-0.5, max(count - 1, 1) + 0.8)
        axes.set_ylim(0.0, 1.22 * float(np.nanmax(np.concatenate([fitted, held_out, [noise]]))))
        axes.set_ylabel(f"RMS residual / {unit}" if unit else "RMS residual")
        axes.set_xlabel("model, step by step", labelpad=3)
    return figure


def _step_name(index: int, step: str, room: int) -> str:
    """Return the name below a step, in lines of ``room`` letters; what was added gets a plus, its driver a line."""
    parts = (
        [step]
        if not index
        else f"+\N{NO-BREAK SPACE}{step.removeprefix('+ ')}".replace("@", "\n@").split("\n")
    )
    return "\n".join(textwrap.fill(part, room, break_on_hyphens=False) for part in parts)


def _at_height(value: float, unit: str) -> str:
    """Return the number beside a point: hundredths of a micrometre, three digits of anything else."""
    return f"{value:.0f}" if value >= 1e3 else f"{value:.2f}" if unit == "µm" else f"{value:.3g}"


@dataclass(frozen=True)
class RankedEffects:
    """Effects (e,) with their ``values`` (e,); equal numbers in ``groups`` (e,) make one group.

    The plan cannot separate the effects of a group. ``notes`` (e,) stand behind the bars instead of the values.
    """

    names: Sequence[str]
    values: npt.ArrayLike
    groups: Sequence[int]
    notes: Sequence[str] | None = None


def ranked_effects(
    effects: RankedEffects,
    *,
    title: str,
    value_name: str,
    threshold: float | None = None,
    threshold_name: str = "",
) -> Figure:
    """Draw effects as bars, strongest group first; a group of several is bracketed.

    Bars that reach ``threshold`` are in the accent colour.
    """
    size = np.asarray(effects.values, dtype=np.float64)
    names, groups = effects.names, effects.groups
    if not names or size.shape != (len(names),) or len(groups) != len(names):
        raise DataError(
            f"{len(names)} effects need as many values and groups, not {size.shape} and {len(groups)}"
        )
    order = _strongest_first(size, groups)
    rows = _rows_of_groups([groups[index] for index in order])
    reaches = [bool(hit) for hit in size[order] >= (np.inf if threshold is None else threshold)]
    notes = effects.notes or [f"{value:.3g}" for value in size]
    top = float(np.max(size))
    with style():
        figure = new_figure(PAGE_WIDTH_MM, 27.0 + 5.2 * float(rows[-1] + 1), title)
        axes = figure.subplots()
        _bars(axes, rows, size[order], reaches)
        _note(axes, rows, size[order], [notes[index] for index in order])
        axes.set_yticks(rows, [names[index] for index in order])
        axes.tick_params(axis="y", length=0)
        axes.set_ylim(rows[-1] + 0.7, -0.7)
        axes.set_xlim(0.0, 1.6 * top if top > 0 else 1.0)
        axes.set_xlabel(value_name)
        if threshold is not None:
            _threshold(axes, threshold, threshold_name)
        _brackets(axes, rows, [groups[index] for index in order], size[order], 1.6 * top)
    return figure


def _bars(axes: Axes, rows: Array, size: Array, accented: Sequence[bool]) -> None:
    """Draw the bars; those that are ``accented`` are hatched, in the accent colour."""
    bars = axes.barh(rows, size, height=0.72, color=[ORANGE if hit else MID for hit in accented], zorder=2)
    for bar, hit in zip(bars, accented, strict=True):
        bar.set_hatch("////" if hit else "")
        bar.set_edgecolor("white")
        bar.set_linewidth(0.0)


def _note(axes: Axes, rows: Array, size: Array, notes: Sequence[str]) -> None:
    """Write a note behind the end of every bar."""
    for row, length, note in zip(rows, size, notes, strict=True):
        axes.annotate(
            note,
            (length, row),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=7,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8},
            zorder=4,
        )


def _threshold(axes: Axes, level: float, name: str) -> None:
    """Draw a dashed level with its name above."""
    axes.axvline(level, color=INK, linewidth=0.9, linestyle=(0, (4, 2)), zorder=3)
    axes.annotate(
        name,
        (level, 1.0),
        xycoords=("data", "axes fraction"),
        xytext=(0, 2),
        textcoords="offset points",
        fontsize=7,
    )


def _strongest_first(size: Array, groups: Sequence[int]) -> list[int]:
    """Return the indices of the effects: groups by their strongest effect, then effects by strength."""
    strongest = {
        group: max(float(value) for value, other in zip(size, groups, strict=True) if other == group)
        for group in set(groups)
    }
    return sorted(
        range(len(size)), key=lambda index: (-strongest[groups[index]], groups[index], -size[index])
    )


def _rows_of_groups(groups: Sequence[int]) -> Array:
    """Return the row of every bar, with room between two groups."""
    rows = np.arange(len(groups), dtype=np.float64)
    for index in range(1, len(groups)):
        if groups[index] != groups[index - 1]:
            rows[index:] += 0.45
    return rows


def _name_lines(axes: Axes, fitted: Array, held_out: Array) -> None:
    """Name the two lines at their last points, moved apart where they nearly meet."""
    last = len(fitted) - 1
    names = [(fitted[last], "fitted runs", BLUE, -1)]
    if np.isfinite(held_out[last]):
        names.append((held_out[last], "held-out runs", ORANGE, 1))
    close = len(names) == 2 and abs(held_out[last] - fitted[last]) < 0.08 * float(
        np.nanmax([fitted, held_out])
    )
    for level, name, colour, side in names:
        axes.annotate(
            name,
            (last, level),
            xytext=(11, 8 * side if close else 0),
            textcoords="offset points",
            va="center",
            fontsize=7.5,
            fontweight="bold",
            color=colour,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.8},
            zorder=6,
        )


def _brackets(axes: Axes, rows: Array, groups: Sequence[int], size: Array, span: float) -> None:
    """Draw a bracket to the right of each group of several effects."""
    for group in dict.fromkeys(groups):
        inside = [index for index, other in enumerate(groups) if other == group]
        if len(inside) < 2:
            continue
        top, bottom = rows[inside[0]] - 0.36, rows[inside[-1]] + 0.36
        inner = float(np.max(size[inside])) + 0.14 * span
        outer = inner + 0.012 * span
        axes.plot([inner, outer, outer, inner], [top, top, bottom, bottom], color=INK, linewidth=0.9)
        axes.text(
            outer + 0.012 * span,
            (top + bottom) / 2,
            "this plan cannot\ntell these apart",
            va="center",
            fontsize=7,
        )
