"""The volumetric error over the stroke: its vectors in space, and slices with lengths and uncertainties."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from monitor.reporting.svg.map_slices import Slice
from monitor.web.charts.chart import Chart, axis, in_template
from monitor.web.words import number

if TYPE_CHECKING:
    from monitor.workflow.volumetric.over_stroke import OverStrokeAnswer

#: The scales of lengths: of arrows, and of cells that numbers are written on.
ARROWS = [[0, "@mid"], [1, "@orange"]]
CELLS = [[0, "@paper"], [1, "@heat"]]

#: From where the strokes are looked at; the middle is lowered, so that the names of the axes stay in a narrow picture.
CAMERA = {"eye": {"x": 1.5, "y": -1.76, "z": 0.98}, "center": {"x": 0.0, "y": 0.0, "z": -0.12}}


def vectors_chart(answer: OverStrokeAnswer) -> Chart:
    """Show the error at every point of the grid as an arrow; its colour is the length in µm."""
    at, vector = np.asarray(answer.readings_mm), np.asarray(answer.vectors_um)
    lengths = np.linalg.norm(vector, axis=1)
    frame = {
        name: axis(f"{of} / mm", backgroundcolor="rgba(0,0,0,0)", showbackground=False, showspikes=False)
        for name, of in zip(("xaxis", "yaxis", "zaxis"), answer.axes, strict=True)
    }
    where = [", ".join(f"{of} {value:.0f}" for of, value in zip(answer.axes, row, strict=True)) for row in at]
    return Chart(
        key="vectors",
        says=f"error vectors at {len(at)} points over the strokes, the largest {number(float(lengths.max()))} µm",
        traces=[
            {
                "type": "cone", "x": at[:, 0].tolist(), "y": at[:, 1].tolist(), "z": at[:, 2].tolist(),
                "u": vector[:, 0].tolist(), "v": vector[:, 1].tolist(), "w": vector[:, 2].tolist(),
                "sizemode": "scaled", "sizeref": 1.1, "anchor": "tail", "colorscale": ARROWS, "cmin": 0,
                # Below, not beside: a telephone has no width for it, and the title of the upright axis was cut off.
                "colorbar": {
                    "title": {"text": "µm", "side": "right"}, "orientation": "h", "thickness": 12, "len": 0.8,
                    "y": 0, "yanchor": "bottom", "ypad": 0,
                },
                "text": [
                    f"{readings} mm: {number(float(length))} ± {number(float(u), 2)} µm"
                    for readings, length, u in zip(where, lengths, answer.expanded_um, strict=True)
                ],
                "hovertemplate": "%{text}<extra></extra>",
            }
        ],
        layout={
            "scene": {**frame, "aspectmode": "data", "camera": CAMERA, "domain": {"y": [0.12, 1.0]}},
            "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
        },
        height=520,
    )  # fmt: skip


def slice_charts(answer: OverStrokeAnswer) -> list[Chart]:
    """Show the three middle slices: the length at every node and, written on it, its expanded uncertainty."""
    longest = max(max(map(max, part.lengths_um)) for part in answer.slices)
    return [_slice(part, longest) for part in answer.slices]


def _slice(part: Slice, longest: float) -> Chart:
    first, second = part.along
    where = f"{in_template(first)} %{{x:.0f}} mm, {in_template(second)} %{{y:.0f}} mm"
    # Rows of the picture run along the second axis.
    lengths = np.array(part.lengths_um).T
    expanded = np.array(part.expanded_um).T
    return Chart(
        key=f"slice-{part.across}",
        says=f"length of the error at {part.across} = {number(part.at_mm)} mm in µm, ± U on every node",
        traces=[
            {
                "type": "heatmap", "x": part.first_mm, "y": part.second_mm, "z": lengths.tolist(), "zmin": 0,
                "zmax": longest, "colorscale": CELLS, "showscale": False, "xgap": 1, "ygap": 1,
                "text": [
                    [f"{number(value)}\n± {number(u, 2)}" for value, u in zip(*rows, strict=True)]
                    for rows in zip(lengths.tolist(), expanded.tolist(), strict=True)
                ],
                "texttemplate": "%{text}", "textfont": {"size": 10, "color": "@ink"},
                "hovertemplate": f"{where}: %{{text}} µm<extra></extra>",
            }
        ],
        layout={"xaxis": axis(f"{first} / mm", showgrid=False), "yaxis": axis(f"{second} / mm", showgrid=False)},
        height=330,
    )  # fmt: skip
