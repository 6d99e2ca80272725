"""Figures of the search for what is missing: error falling model by model, and effects ranked in their groups."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from monitor.exceptions import DataError
from monitor.reporting.figures.style import new_figure, reference_line, style
from monitor.reporting.palette import BLUE, INK, MID, ORANGE, PAGE_WIDTH_MM, PALE


def error_falling(
    steps: Sequence[str],
    rms_um: npt.ArrayLike,
    heldout_rms_um: npt.ArrayLike,
    *,
    noise_um: float,
    title: str,
    noise_name: str = "noise floor",
    unit: str = "µm",
) -> Figure:
    """RMS residual in µm, or in another ``unit``, of every model version (s,): on the fitted and on held-out runs.

    ``steps`` names what each version added, the base model first; the others get a plus. NaN where a
    version has no held-out error.
    """
    fitted = np.asarray(rms_um, dtype=np.float64)
    held = np.asarray(heldout_rms_um, dtype=np.float64)
    if not steps or fitted.shape != (len(steps),) or held.shape != (len(steps),):
        raise DataError(
            f"{len(steps)} steps need rms_um and heldout_rms_um of shape ({len(steps)},), "
            f"not {fitted.shape} and {held.shape}"
        )
    at = np.arange(len(steps), dtype=np.float64)
    with style():
        figure = new_figure(PAGE_WIDTH_MM, 82.0, title)
        axes = figure.subplots()
        axes.axhspan(0.0, noise_um, color=PALE, alpha=0.45, linewidth=0, zorder=0)
        reference_line(axes, noise_um)
        axes.text(-0.45, noise_um / 2, f"{noise_name} {noise_um:.2g} {unit}", va="center", fontsize=7.5)
        axes.plot(
            at,
            held,
            "s--",
            color=ORANGE,
            markersize=5.5,
            markerfacecolor="white",
            markeredgewidth=1.4,
            zorder=4,
        )
        axes.plot(at, fitted, "o-", color=BLUE, markersize=5.5, zorder=5)
        _name_lines(axes, fitted, held)
        for index in range(len(steps)):
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
            if np.isfinite(held[index]):
                axes.annotate(
                    _at_height(held[index], unit),
                    (index, held[index]),
                    xytext=(0, 6),
                    textcoords="offset points",
                    ha="center",
                    fontsize=7,
                    color=INK,
                )
        labels = [
            textwrap.fill(step, 20)
            if place == 0
            else f"+\N{NO-BREAK SPACE}{step.removeprefix('+ ')}".replace("@", "\n@")
            for place, step in enumerate(steps)
        ]
        axes.set_xticks(at, labels)
        axes.set_xlim(-0.5, max(len(steps) - 1, 1) + 0.8)
        axes.set_ylim(0.0, 1.22 * float(np.nanmax(np.concatenate([fitted, held, [noise_um]]))))
        axes.set_ylabel(f"RMS residual / {unit}" if unit else "RMS residual")
        axes.set_xlabel("model, step by step", labelpad=3)
    return figure


def _at_height(value: float, unit: str) -> str:
    """A number beside its point: hundredths of a micrometre, three digits of anything else."""
    return f"{value:.2f}" if unit == "µm" else f"{value:.3g}"


def ranked_effects(
    effects: Sequence[str],
    values: npt.ArrayLike,
    groups: Sequence[int],
    *,
    title: str,
    value_name: str,
    notes: Sequence[str] | None = None,
    threshold: float | None = None,
    threshold_name: str = "",
) -> Figure:
    """Effects (e,), strongest first, as bars of ``values`` (e,); equal numbers in ``groups`` (e,) make one group.

    Effects of a group cannot be told apart with the plan: their bars are bracketed. ``notes`` stand behind the
    bars. Bars that reach ``threshold`` are in the accent colour.
    """
    size = np.asarray(values, dtype=np.float64)
    if not effects or size.shape != (len(effects),) or len(groups) != len(effects):
        raise DataError(
            f"{len(effects)} effects need as many values and groups, not {size.shape} and {len(groups)}"
        )
    order = sorted(
        range(len(effects)),
        key=lambda place: (
            -max(size[other] for other in _members(groups, place)),
            groups[place],
            -size[place],
        ),
    )
    rows = np.arange(len(order), dtype=np.float64)
    for later in range(1, len(order)):
        if groups[order[later]] != groups[order[later - 1]]:
            rows[later:] += 0.45
    found = [threshold is not None and size[place] >= threshold for place in order]
    top = float(np.max(size))
    with style():
        figure = new_figure(PAGE_WIDTH_MM, 27.0 + 5.2 * float(rows[-1] + 1), title)
        axes = figure.subplots()
        bars = axes.barh(
            rows, size[order], height=0.72, color=[ORANGE if hit else MID for hit in found], zorder=2
        )
        for bar, hit in zip(bars, found, strict=True):
            bar.set_hatch("////" if hit else "")
            bar.set_edgecolor("white")
            bar.set_linewidth(0.0)
        for row, place in zip(rows, order, strict=True):
            axes.annotate(
                notes[place] if notes else f"{size[place]:.3g}",
                (size[place], row),
                xytext=(4, 0),
                textcoords="offset points",
                va="center",
                fontsize=7,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8},
                zorder=4,
            )
        axes.set_yticks(rows, [effects[place] for place in order])
        axes.tick_params(axis="y", length=0)
        axes.set_ylim(rows[-1] + 0.7, -0.7)
        axes.set_xlim(0.0, 1.6 * top if top > 0 else 1.0)
        axes.set_xlabel(value_name)
        if threshold is not None:
            axes.axvline(threshold, color=INK, linewidth=0.9, linestyle=(0, (4, 2)), zorder=3)
            axes.annotate(
                threshold_name,
                (threshold, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(0, 2),
                textcoords="offset points",
                fontsize=7,
            )
        _brackets(axes, rows, [groups[place] for place in order], size[order], 1.6 * top)
    return figure


def _name_lines(axes: Axes, fitted: npt.NDArray[np.float64], held: npt.NDArray[np.float64]) -> None:
    """The two lines named at their last points, moved apart where they nearly meet."""
    last = len(fitted) - 1
    names = [(fitted[last], "fitted runs", BLUE, -1)]
    if np.isfinite(held[last]):
        names.append((held[last], "held-out runs", ORANGE, 1))
    close = len(names) == 2 and abs(held[last] - fitted[last]) < 0.08 * float(np.nanmax([fitted, held]))
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


def _members(groups: Sequence[int], place: int) -> list[int]:
    return [other for other, group in enumerate(groups) if group == groups[place]]


def _brackets(
    axes: Axes,
    rows: npt.NDArray[np.float64],
    groups: Sequence[int],
    size: npt.NDArray[np.float64],
    span: float,
) -> None:
    """A bracket to the right of each group of several effects."""
    for group in dict.fromkeys(groups):
        inside = [place for place, other in enumerate(groups) if other == group]
        if len(inside) < 2:
            continue
        top, bottom = rows[inside[0]] - 0.36, rows[inside[-1]] + 0.36
        left = float(np.max(size[inside])) + 0.14 * span
        right = left + 0.012 * span
        axes.plot([left, right, right, left], [top, top, bottom, bottom], color=INK, linewidth=0.9)
        axes.text(
            right + 0.012 * span,
            (top + bottom) / 2,
            "this plan cannot\ntell these apart",
            va="center",
            fontsize=7,
        )
