"""Draws the residual of a model against what drives it, and against the prediction of an effect."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.figures.style import caption, new_figure, style, zero_line
from monitor.reporting.palette import BLUE, FAINT, INK, MID, ORANGE, PAGE_WIDTH_MM


@dataclass(frozen=True)
class DrivenResiduals:
    """Residuals (n,) µm at the values of a driver (n,).

    ``group`` (n,) assigns the groups; without it the driver is cut into ``bins`` of equal numbers of points.
    ``after_um`` (n,) are the residuals after a missing effect was added.
    """

    driver: npt.ArrayLike
    residual_um: npt.ArrayLike
    group: npt.ArrayLike | None = None
    bins: int = 8
    after_um: npt.ArrayLike | None = None


def residual_against_driver(
    residuals: DrivenResiduals, *, title: str, driver_name: str, residual_name: str = "residual / µm"
) -> Figure:
    """Draw residuals against a driver, with the mean of each group and ± 1 standard error of it.

    The means are drawn to guide the eye and are no stored result.
    """
    x = np.asarray(residuals.driver, dtype=np.float64)
    y = np.asarray(residuals.residual_um, dtype=np.float64)
    if x.shape != y.shape or x.ndim != 1:
        raise DataError(f"driver and residual_um must have one shape (n,), but have {x.shape} and {y.shape}")
    keep = np.isfinite(x) & np.isfinite(y)
    x, y = x[keep], y[keep]
    group, after = residuals.group, residuals.after_um
    labels = _equal_parts(x, residuals.bins) if group is None else np.asarray(group)[keep]

    with style():
        figure = new_figure(0.72 * PAGE_WIDTH_MM, 78.0, title)
        axes = figure.subplots()
        zero_line(axes)
        axes.scatter(x, y, s=6, color=MID, alpha=0.45, linewidths=0, zorder=1)
        _group_means(axes, x, y, labels, "o-", ORANGE)
        legend = "grey: single probings; circles: means of groups, ± 1 standard error"
        if after is not None:
            _group_means(axes, x, np.asarray(after, dtype=np.float64)[keep], labels, "s-", BLUE)
            legend += "; squares: the same with what is missing added"
        caption(figure, legend)
        axes.set_xlabel(driver_name)
        axes.set_ylabel(residual_name)
    return figure


def _group_means(
    axes: Axes, x: Array, y: Array, labels: npt.NDArray[np.generic], look: str, colour: str
) -> None:
    """Draw the means (g,) of the groups of ``labels`` (n,) with their standard errors, joined by a line."""
    centres, means, errors = [], [], []
    for label in dict.fromkeys(labels.tolist()):
        inside = labels == label
        centres.append(float(np.mean(x[inside])))
        means.append(float(np.mean(y[inside])))
        count = int(inside.sum())
        errors.append(float(np.std(y[inside], ddof=1)) / math.sqrt(count) if count > 1 else 0.0)
    order = np.argsort(centres)
    axes.errorbar(
        np.array(centres)[order],
        np.array(means)[order],
        yerr=np.array(errors)[order],
        fmt=look,
        color=colour,
        markeredgecolor=INK,
        markeredgewidth=0.6,
        markersize=5,
        linewidth=1.2,
        capsize=2.5,
        zorder=3,
    )


def predicted_against_measured(
    predicted_um: npt.ArrayLike, measured_um: npt.ArrayLike, *, title: str, noise_um: float | None = None
) -> Figure:
    """Draw the prediction of an effect (n,) against the residual measured without it (n,), both in µm.

    Points on the line of equality are explained; ``noise_um`` draws a band of ± 2 standard deviations.
    """
    x, y = np.asarray(predicted_um, dtype=np.float64), np.asarray(measured_um, dtype=np.float64)
    if x.shape != y.shape or x.ndim != 1 or not len(x):
        raise DataError(
            f"predicted_um and measured_um must have one shape (n,), but have {x.shape} and {y.shape}"
        )
    reach = 1.08 * max(float(np.max(np.abs(x))), float(np.max(np.abs(y)))) or 1.0
    with style():
        figure = new_figure(0.6 * PAGE_WIDTH_MM, 0.6 * PAGE_WIDTH_MM, title)
        axes = figure.subplots()
        ends = np.array([-reach, reach])
        if noise_um is not None:
            axes.fill_between(
                ends, ends - 2 * noise_um, ends + 2 * noise_um, color=FAINT, linewidth=0, zorder=0
            )
        axes.plot(ends, ends, color=INK, linewidth=0.9, zorder=2)
        zero_line(axes)
        zero_line(axes, vertical=True)
        axes.scatter(x, y, s=9, color=BLUE, alpha=0.6, linewidths=0, zorder=3)
        axes.annotate(
            "fully explained",
            (0.97 * reach, 0.97 * reach),
            xytext=(-4, -12),
            textcoords="offset points",
            ha="right",
            va="top",
            fontsize=7,
            rotation=45,
            rotation_mode="anchor",
        )
        if noise_um is not None:
            axes.text(
                0.02,
                0.98,
                f"band: ± 2 × {noise_um:.2g} µm of noise",
                transform=axes.transAxes,
                va="top",
                fontsize=7,
            )
        axes.set_xlim(-reach, reach)
        axes.set_ylim(-reach, reach)
        axes.set_aspect("equal")
        for axis in (axes.xaxis, axes.yaxis):
            # Of a thousandth of a micrometre nine numbers would stand on each other.
            axis.set_major_locator(MaxNLocator(5, min_n_ticks=3))
        axes.set_xlabel("predicted by the effect / µm")
        axes.set_ylabel("measured residual without it / µm")
    return figure


def _equal_parts(values: Array, parts: int) -> npt.NDArray[np.int64]:
    edges = np.quantile(values, np.linspace(0.0, 1.0, parts + 1)[1:-1])
    return np.asarray(np.searchsorted(edges, values, side="right"), dtype=np.int64)
