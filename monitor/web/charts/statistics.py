"""A campaign's statistics as pictures: correlation matrix, p-values of its coordinates, coverage regions of a pair."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from monitor.web.charts.chart import Chart, Trace, axis

if TYPE_CHECKING:
    from monitor.workflow.run_statistics.answer import HistogramAnswer, StatisticsAnswer
    from monitor.workflow.uncertainty.answer import UncertaintyAnswer
    from monitor.workflow.uncertainty.cloud import CloudAnswer

#: The tests as people know them.
TESTS = {"bartlett": "Bartlett (equal scatter)", "anova": "ANOVA (equal means)"}
#: Points of the outline of an ellipse.
OUTLINE = 181


def correlation_chart(answer: StatisticsAnswer) -> Chart:
    """Show the pooled correlation matrix of the parameters."""
    names = list(answer.parameter_order)
    freedom = answer.degrees_of_freedom_pooled
    matrix = np.asarray(answer.correlation_pooled, dtype=float)
    return Chart(
        key="correlation",
        says=f"correlation matrix of the parameters, pooled within the groups ({freedom} degrees of freedom)",
        traces=[
            {
                "type": "heatmap", "x": names, "y": names, "z": [_row(row) for row in matrix.tolist()], "zmin": -1,
                "zmax": 1, "colorscale": [[0, "@blue"], [0.5, "@paper"], [1, "@orange"]], "xgap": 1, "ygap": 1,
                "hovertemplate": "%{x}, %{y}: %{z:.2f}<extra></extra>",
                "colorbar": {"thickness": 12, "title": {"text": "r"}},
            }
        ],
        layout={
            "xaxis": axis("", type="category", constrain="domain", showgrid=False),
            "yaxis": axis(
                "", type="category", autorange="reversed", scaleanchor="x", constrain="domain", showgrid=False
            ),
        },
        height=460,
    )  # fmt: skip


def _row(row: Sequence[float]) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in row]


def p_value_chart(name: str, histogram: HistogramAnswer, count: int) -> Chart:
    """Show the histogram of the p-values of the probed coordinates, with the height that equal groups would give."""
    edges = histogram.edges
    middles = [(low + high) / 2 for low, high in pairwise(edges)]
    return Chart(
        key=f"p-{name}",
        says=f"p-values of {count} probed coordinates, {TESTS.get(name, name)}; dashed: where the groups are equal",
        traces=[
            {
                "type": "bar", "x": middles, "y": list(histogram.counts),
                "width": (edges[-1] - edges[0]) / len(middles),
                "marker": {"color": "@blue", "line": {"color": "@paper", "width": 1}},
                "hovertemplate": "p about %{x:.2f}: %{y}<extra></extra>",
            }
        ],
        layout={
            "xaxis": axis(f"p-value, {TESTS.get(name, name)}", range=[0, 1]), "yaxis": axis("coordinates"), "bargap": 0,
            "shapes": [
                {
                    "type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": histogram.expected,
                    "y1": histogram.expected,
                    "line": {"color": "@orange", "dash": "dash"},
                }
            ],
        },
        height=280,
    )  # fmt: skip


@dataclass(frozen=True)
class _Region:
    """An ellipse (k_p) and a rectangle (k_q), and what they hold together; None where so few degrees of freedom bound
    none."""

    holds: str
    k_p: float | None
    k_q: float | None

    def words(self) -> str:
        """What is drawn, and what is not since nothing bounds it."""
        ellipse = (
            f"ellipse with k_p = {self.k_p:.2f}"
            if self.k_p is not None
            else "no ellipse, which would need more degrees of freedom than parameters"
        )
        rectangle = (
            f"rectangle with k_q = {self.k_q:.2f}"
            if self.k_q is not None
            else "no rectangle, which would need degrees of freedom"
        )
        return f"{ellipse}, {rectangle}: what holds {self.holds}"


def region_chart(answer: UncertaintyAnswer, first: str, second: str) -> Chart:
    """Show two parameters with the ellipse and the rectangle that hold all parameters together, by the framework."""
    result = answer.guf
    i, j = (answer.parameters.index(name) for name in (first, second))
    count = len(answer.parameters)
    region = _Region(
        f"all {count}",
        result.k_p_with_degrees_of_freedom,
        result.k_q_with_degrees_of_freedom,
    )
    return _regions(
        f"of run {answer.run}", (first, second), (answer.units[first], answer.units[second]),
        (result.estimate[first], result.estimate[second]), (result.u[first], result.u[second]),
        float(np.asarray(result.correlation)[i, j]), [region], [],
    )  # fmt: skip


def cloud_chart(answer: CloudAnswer) -> Chart:
    """Show the trials of two parameters with the regions that hold the pair, and those that hold all parameters."""
    trials = np.asarray(answer.trials)
    cloud: Trace = {
        "type": "scatter", "mode": "markers", "name": f"{len(trials)} of the Monte Carlo trials",
        "x": trials[:, 0].tolist(), "y": trials[:, 1].tolist(), "hoverinfo": "skip",
        "marker": {"size": 3, "color": "@mid", "opacity": 0.5},
    }  # fmt: skip
    regions = [
        _Region("the pair", answer.k_p_with_degrees_of_freedom, answer.k_q_with_degrees_of_freedom),
        _Region(
            f"all {answer.parameters}",
            answer.k_p_of_all_with_degrees_of_freedom,
            answer.k_q_of_all_with_degrees_of_freedom,
        ),
    ]
    return _regions(
        f"of run {answer.run}", answer.names, answer.units, answer.estimate, answer.u, answer.correlation,
        regions, [cloud],
    )  # fmt: skip


def _regions(
    of: str, names: tuple[str, str], units: tuple[str, str], estimate: tuple[float, float], u: tuple[float, float],
    correlation: float, regions: Sequence[_Region], drawn: Sequence[Trace],
) -> Chart:  # fmt: skip
    centre, spread = np.array(estimate), np.array(u)
    root = np.array([[u[0], 0.0], [correlation * u[1], math.sqrt(max(1.0 - correlation**2, 0.0)) * u[1]]])
    angle = np.linspace(0.0, 2.0 * np.pi, OUTLINE)
    # Drawn with room around: a line at the edge of the axes is cut in half.
    widest = max((k for region in regions for k in (region.k_p, region.k_q) if k is not None), default=2.0)
    reach = 1.08 * widest * spread
    for trials in (np.array([cloud["x"], cloud["y"]]) for cloud in drawn):
        reach = np.maximum(reach, 1.02 * np.abs(trials - centre[:, None]).max(axis=1))
    ends = [[float(middle - far), float(middle + far)] for middle, far in zip(centre, reach, strict=True)]
    traces = list(drawn)
    for number, region in enumerate(regions):
        width, is_first = (2.5, True) if number == 0 else (1.2, False)
        if region.k_p is not None:
            outline = centre[:, None] + region.k_p * root @ np.array([np.cos(angle), np.sin(angle)])
            traces.append(
                {
                    "type": "scatter", "mode": "lines", "name": f"ellipse of {region.holds}, k_p = {region.k_p:.2f}",
                    "x": outline[0].tolist(), "y": outline[1].tolist(),
                    "line": {"color": "@blue", "width": width, "dash": "solid" if is_first else "dot"},
                    "hoverinfo": "name",
                }
            )  # fmt: skip
        if region.k_q is not None:
            low, high = centre - region.k_q * spread, centre + region.k_q * spread
            traces.append(
                {
                    "type": "scatter", "mode": "lines", "name": f"rectangle of {region.holds}, k_q = {region.k_q:.2f}",
                    "x": [low[0], high[0], high[0], low[0], low[0]],
                    "y": [low[1], low[1], high[1], high[1], low[1]],
                    "line": {"color": "@orange", "width": width, "dash": "dash" if is_first else "dot"},
                    "hoverinfo": "name",
                }
            )  # fmt: skip
    traces.append(
        {
            "type": "scatter", "mode": "markers", "name": "estimate", "x": [estimate[0]], "y": [estimate[1]],
            "marker": {"symbol": "cross", "size": 11, "color": "@ink"},
        }
    )  # fmt: skip
    return Chart(
        key="region",
        says=f"{names[0]} and {names[1]} {of}: {regions[0].words()}",
        traces=traces,
        layout={
            "xaxis": axis(f"{names[0]} / {units[0]}", range=ends[0]),
            "yaxis": axis(f"{names[1]} / {units[1]}", range=ends[1]),
        },
        height=480,
    )
