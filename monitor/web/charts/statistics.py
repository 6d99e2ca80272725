"""A campaign's statistics as pictures: correlation matrix, p-values of its coordinates, coverage regions of a pair."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from monitor.web.charts.chart import Chart, axis
from monitor.workflow.run_statistics.answer import HistogramAnswer, StatisticsAnswer
from monitor.workflow.uncertainty.answer import UncertaintyAnswer

#: Points of the outline of an ellipse.
OUTLINE = 181
#: Points of the cloud: enough to see 1 in 20 outside, few enough for an old telephone.
CLOUD = 2000


def correlation_chart(answer: StatisticsAnswer) -> Chart:
    """Show the pooled correlation matrix of the parameters."""
    names = list(answer.parameter_order)
    matrix = np.asarray(answer.correlation_pooled, dtype=float)
    return Chart(
        key="correlation",
        says="correlation matrix of the parameters, pooled within the groups",
        traces=[
            {
                "type": "heatmap", "x": names, "y": names, "z": [_row(row) for row in matrix.tolist()], "zmin": -1,
                "zmax": 1, "colorscale": [[0, "@blue"], [0.5, "@paper"], [1, "@orange"]], "xgap": 1, "ygap": 1,
                "hovertemplate": "%{x}, %{y}: %{z:.2f}<extra></extra>",
                "colorbar": {"thickness": 12, "title": {"text": "r"}},
            }
        ],
        layout={
            "xaxis": axis("", type="category"),
            "yaxis": axis("", type="category", autorange="reversed", scaleanchor="x"),
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
        says=f"p-values of {count} probed coordinates, {name}; flat where the groups are equal",
        traces=[
            {
                "type": "bar", "x": middles, "y": list(histogram.counts),
                "width": (edges[-1] - edges[0]) / len(middles),
                "marker": {"color": "@blue", "line": {"color": "@paper", "width": 1}},
                "hovertemplate": "p about %{x:.2f}: %{y}<extra></extra>",
            }
        ],
        layout={
            "xaxis": axis(f"p-value, {name}", range=[0, 1]), "yaxis": axis("coordinates"), "bargap": 0,
            "shapes": [
                {
                    "type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": histogram.expected,
                    "y1": histogram.expected,
                    "line": {"color": "@orange", "dash": "dash"},
                    "label": {"text": "equal groups", "font": {"size": 11, "color": "@orange"}, "textposition": "end"},
                }
            ],
        },
        height=280,
    )  # fmt: skip


def region_chart(answer: UncertaintyAnswer, first: str, second: str) -> Chart:
    """Show two parameters with the ellipse (k_p) and the rectangle (k_q) that hold all parameters together.

    The dots are drawn from the normal distribution of the reported estimate and covariance with the seed of the Monte
    Carlo result: a picture of what is reported, not the trials themselves, which are not stored.
    """
    result = answer.guf if answer.mcm is None else answer.mcm
    i, j = (answer.parameters.index(name) for name in (first, second))
    centre = np.array([result.estimate[first], result.estimate[second]])
    u = np.array([result.u[first], result.u[second]])
    r = float(np.asarray(result.correlation)[i, j])
    k_p, k_q = result.k_p, result.k_q
    if answer.mcm is None:
        k_p = answer.guf.k_p_with_degrees_of_freedom or k_p
        k_q = answer.guf.k_q_with_degrees_of_freedom or k_q
    root = np.array([[u[0], 0.0], [r * u[1], math.sqrt(max(1.0 - r * r, 0.0)) * u[1]]])
    angle = np.linspace(0.0, 2.0 * np.pi, OUTLINE)
    outline = centre[:, None] + k_p * root @ np.array([np.cos(angle), np.sin(angle)])
    seed = 0 if answer.mcm is None else answer.mcm.seed
    cloud = centre[:, None] + root @ np.random.default_rng(seed).standard_normal((2, CLOUD))
    low, high = centre - k_q * u, centre + k_q * u
    return Chart(
        key="region",
        says=f"{first} and {second} of run {answer.run}: ellipse with k_p = {k_p:.2f}, rectangle with k_q = {k_q:.2f}",
        traces=[
            {
                "type": "scatter", "mode": "markers", "name": "drawn from the reported covariance",
                "x": np.round(cloud[0], 6).tolist(), "y": np.round(cloud[1], 6).tolist(), "hoverinfo": "skip",
                "marker": {"size": 3, "color": "@mid", "opacity": 0.5},
            },
            {
                "type": "scatter", "mode": "lines", "name": f"ellipse, k_p = {k_p:.2f}", "x": outline[0].tolist(),
                "y": outline[1].tolist(), "line": {"color": "@blue", "width": 2}, "hoverinfo": "name",
            },
            {
                "type": "scatter", "mode": "lines", "name": f"rectangle, k_q = {k_q:.2f}",
                "x": [low[0], high[0], high[0], low[0], low[0]], "y": [low[1], low[1], high[1], high[1], low[1]],
                "line": {"color": "@orange", "width": 2, "dash": "dash"}, "hoverinfo": "name",
            },
            {
                "type": "scatter", "mode": "markers", "name": "estimate", "x": [centre[0]], "y": [centre[1]],
                "marker": {"symbol": "cross", "size": 11, "color": "@ink"},
            },
        ],
        layout={
            "xaxis": axis(f"{first} / {answer.units[first]}"), "yaxis": axis(f"{second} / {answer.units[second]}"),
        },
        height=440,
    )  # fmt: skip
