"""The shape of a workpiece from a fitted free-form campaign, drawn raw and identified."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from monitor.discovery import Fit
from monitor.methods.free_form.problem import FreeFormProblem
from monitor.records import Array
from monitor.reporting.figures import titles
from monitor.reporting.figures.shape import Deviations, raw_and_identified
from monitor.reporting.figures.style import Figure
from monitor.units import DEGREE, MICROMETRE
from monitor.workflow.figure_files import save_figure

#: k of the drawn bars, as the figures of the method's source have it.
K = 2.0


def shape_figure(name: str, fit: Fit, folder: Path) -> list[str]:
    """Draw the first run: what was read at every angle beside the identified shape; nothing for other methods."""
    problem = fit.problem
    if not isinstance(problem, FreeFormProblem):
        return []
    return save_figure(_raw_and_identified(name, fit, problem), folder, "shape-raw-and-identified")


def _raw_and_identified(name: str, fit: Fit, problem: FreeFormProblem) -> Figure:
    context, plane, run = problem.context, problem.plane, problem.runs[0]
    rows = np.flatnonzero(context.run == run)
    points, first = np.unique(context.target[rows], return_index=True)
    angles, raw = _readings(problem, rows)
    columns = [problem.local_names.index(f"shape({point})") for point in points]
    free = fit.solution.local_free[0, columns]
    shape = np.where(free, fit.solution.local[0, columns], np.nan)
    variance = np.diag(fit.solution.local_covariance[0])[columns]
    in_plane = [int(np.argmax(np.abs(joint.direction))) for joint in (plane.u, plane.v)]
    um = MICROMETRE.to_display(1.0)
    return raw_and_identified(
        Deviations(
            context.nominal[rows[first]][:, in_plane],
            problem.normals[rows[first]][:, in_plane],
            raw * um,
            angles,
            shape * um,
            np.where(free, K * um * np.sqrt(variance), np.nan),
        ),
        title=titles.shape_title(
            name,
            run,
            um * float(np.nanmax(np.ptp(raw, axis=1))),
            K * um * float(np.sqrt(variance[free].max(initial=0.0))),
        ),
        axes_names=(plane.u.name, plane.v.name),
    )


def _readings(problem: FreeFormProblem, rows: npt.NDArray[np.int64]) -> tuple[list[float], Array]:
    """The angles of the table in degrees and the readings (points, angles) in mm, NaN where there is none."""
    context = problem.context
    table = context.chain.index(problem.plane.table.name)
    sign = context.chain.joints[table].sign
    degrees = np.round(sign * context.positions[rows, table] / DEGREE.factor, 6).tolist()
    angles = list(dict.fromkeys(degrees))
    points, point = np.unique(context.target[rows], return_inverse=True)
    raw = np.full((len(points), len(angles)), np.nan)
    raw[point, [angles.index(angle) for angle in degrees]] = problem.as_read[rows, 0]
    return angles, raw
