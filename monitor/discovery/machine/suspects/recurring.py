"""Readings that recur: half the runs or more left the same at nearly the same place: it is the machine, and no bad
point.

A plate that is laid anew in every run stands some millimetres or milliradians elsewhere, and no pose of the plan is
repeated to the digit: what the model lacks at a few places looks like bad points of every run.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.noise.plan_cells import plan_cells
from monitor.discovery.machine.suspects.anomalies import BadPoint

# Places so near, as a part of what each axis travelled, are the same one: a plate laid anew by hand, 5 mm of 500 mm.
NEAR_PART = 0.01
# Two points are off alike where they differ by less than this part of the one.
PART_ALIKE = 0.5
# More of all rows than this, and at least so many, which nothing checks, are an error that the model lacks rather than
# mistakes: one or two readings go wrong in the shortest campaign.
MOST_UNCHECKED, FEWEST_UNCHECKED = 0.01, 3


def _fellows(fit: Fit, row: int) -> npt.NDArray[np.int64]:
    """The row of every other run that reads the same target nearly there; of several that which comes
    at about the same place of its run."""
    context = fit.problem.context
    near = NEAR_PART * np.ptp(context.positions, axis=0) + 1e-9
    alike = np.all(np.abs(context.positions - context.positions[row]) <= near, axis=1)
    alike &= (context.target == context.target[row]) & (context.run != context.run[row])
    rows = np.flatnonzero(alike)
    runs, first = np.unique(context.run, return_index=True)
    in_run = np.arange(len(context)) - first[np.searchsorted(runs, context.run)]
    rows = rows[np.argsort(np.abs(in_run[rows] - in_run[row]), kind="stable")]
    return rows[np.unique(context.run[rows], return_index=True)[1]]


def recurring(fit: Fit, points: Sequence[BadPoint]) -> frozenset[int]:
    """The rows of the points that half of the runs that read there share, two at least: off along the same axis by
    about as much.

    Where two other runs repeat the very pose, a point is bad by its deviation from them, whatever they share.
    """
    cells = plan_cells(fit.problem)
    repeats = np.bincount(cells)[cells] - 1
    of_row = {point.row: point for point in points if repeats[point.row] < 2}
    rows = set()
    for row, point in of_row.items():
        fellows = _fellows(fit, row)
        alike = [
            of_row[fellow]
            for fellow in fellows.tolist()
            if fellow in of_row
            and of_row[fellow].axis == point.axis
            and abs(of_row[fellow].size - point.size) < PART_ALIKE * abs(point.size)
        ]
        if alike and 2 * (1 + len(alike)) >= 1 + len(fellows):
            rows.add(row)
    return frozenset(rows)


def are_unchecked(fit: Fit, points: Sequence[BadPoint]) -> bool:
    """Whether more of the points than mistakes account for lie where no other run read."""
    rows = [row for point in points for row in point.all_rows if not len(_fellows(fit, point.row))]
    return len(rows) >= FEWEST_UNCHECKED and len(rows) > MOST_UNCHECKED * len(fit.problem.context)
