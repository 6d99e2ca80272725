"""The shape of a workpiece from a fitted free-form campaign, drawn raw and identified."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from monitor.discovery import Fit
from monitor.methods.free_form.problem import FreeFormProblem
from monitor.reporting.figures.shape import Deviations, raw_and_identified
from monitor.reporting.figures.style import save
from monitor.units import DEGREE, MICROMETRE

#: k of the drawn bars, as the figures of the method's source have it.
K = 2.0
ENDINGS = (".svg", ".png")


def shape_figure(name: str, found: Fit, folder: Path) -> list[str]:
    """The first run: what was read at every angle beside the identified shape; nothing for other methods."""
    problem = found.problem
    if not isinstance(problem, FreeFormProblem):
        return []
    context, plane = problem.context, problem.plane
    run = problem.runs[0]
    rows = np.flatnonzero(context.run == run)
    table = context.chain.index(plane.table.name)
    sign = context.chain.joints[table].sign
    degrees = np.round(sign * context.positions[rows, table] / DEGREE.factor, 6)
    angles = list(dict.fromkeys(degrees.tolist()))
    points, first = np.unique(context.target[rows], return_index=True)
    raw = np.full((len(points), len(angles)), np.nan)
    at = np.searchsorted(points, context.target[rows])
    raw[at, [angles.index(angle) for angle in degrees.tolist()]] = problem.as_read[rows, 0]
    columns = [problem.local_names.index(f"shape({point})") for point in points]
    free = found.solution.local_free[0, columns]
    shape = np.where(free, found.solution.local[0, columns], np.nan)
    variance = np.diag(found.solution.local_covariance[0])[columns]
    in_plane = [int(np.argmax(np.abs(joint.direction))) for joint in (plane.u, plane.v)]
    um = MICROMETRE.to_display(1.0)
    figure = raw_and_identified(
        Deviations(
            context.nominal[rows[first]][:, in_plane],
            problem.normals[rows[first]][:, in_plane],
            raw * um,
            angles,
            shape * um,
            np.where(free, K * um * np.sqrt(variance), np.nan),
        ),
        title=f"{name}, run {run}: the angles disagree by up to {um * float(np.nanmax(np.ptp(raw, axis=1))):.1f} µm; "
        f"U of the shape at most {K * um * float(np.sqrt(variance[free].max(initial=0.0))):.1f} µm",
        axes_names=(plane.u.name, plane.v.name),
    )
    return [str(save(figure, folder / f"shape-raw-and-identified{ending}")) for ending in ENDINGS]
