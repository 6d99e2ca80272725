"""The correlation matrix as a map: how dark says how strong, the printed number or sign says which way."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from monitor.exceptions import DataError
from monitor.reporting.figure_style import INK, MID, PAGE_WIDTH_MM, new_figure, style
from monitor.reporting.numbers import MINUS, written_correlation

#: Up to so many parameters the coefficients are printed in the cells; above, their signs where |r| > 0.3.
_NUMBERS_UP_TO = 16
_GREYS = LinearSegmentedColormap.from_list("strength", ["#ffffff", "#c3c8ce", "#7c838c", "#2b3138"])


def correlation_map(names: Sequence[str], correlation: npt.ArrayLike, *, title: str) -> Figure:
    """The lower triangle of ``correlation`` (m, m) in greys of its absolute value, signs in words or numbers."""
    matrix = np.asarray(correlation, dtype=np.float64)
    count = len(names)
    if matrix.shape != (count, count):
        raise DataError(
            f"{count} names need a correlation matrix of shape ({count}, {count}), not {matrix.shape}"
        )
    lower = np.ma.masked_array(np.abs(matrix), mask=np.triu(np.ones((count, count), dtype=bool), 1))
    side = min(PAGE_WIDTH_MM, 45.0 + 9.0 * count)
    with style():
        figure = new_figure(side, 0.88 * side + 8.0, title)
        axes = figure.subplots()
        mesh = axes.pcolormesh(lower, cmap=_GREYS, vmin=0.0, vmax=1.0, edgecolors="white", linewidth=0.6)
        for row in range(count):
            for column in range(row):
                value = float(matrix[row, column])
                if count <= _NUMBERS_UP_TO:
                    text = written_correlation(value).replace("0.", ".", 1)
                else:
                    text = ("+" if value > 0 else MINUS) if abs(value) > 0.3 else ""
                axes.text(
                    column + 0.5,
                    row + 0.5,
                    text,
                    ha="center",
                    va="center",
                    fontsize=6,
                    color="white" if abs(value) > 0.55 else INK,
                )
        axes.set_xticks(np.arange(count) + 0.5, names, rotation=90)
        axes.set_yticks(np.arange(count) + 0.5, names)
        axes.tick_params(length=0)
        axes.invert_yaxis()
        axes.set_aspect("equal")
        for spine in axes.spines.values():
            spine.set_visible(False)
        bar = figure.colorbar(mesh, ax=axes, shrink=0.5, aspect=22, pad=0.02)
        bar.set_label("absolute value of the correlation coefficient")
        bar.outline.set_edgecolor(MID)
        bar.outline.set_linewidth(0.5)
    return figure
