"""The cells of a plan: which readings of several runs are of the same touch."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from monitor.methods.chain.problem import ChainProblem


def plan_cells(problem: ChainProblem) -> npt.NDArray[np.int64]:
    """The cell (n,) of the plan: the same number for the same target at the same pose, touch by touch."""
    context = problem.context
    measured = problem.measured_joints
    posed = [joint for joint in range(len(context.chain.joints)) if joint not in measured]
    angles = np.round(context.positions[:, posed], 6) + 0.0
    occurrences: dict[tuple[object, ...], int] = {}
    numbers: dict[tuple[object, ...], int] = {}
    cells = np.empty(len(context), dtype=np.int64)
    for row in range(len(context)):
        key = (str(context.target[row]), *angles[row])
        in_run = (int(context.run[row]), *key)
        occurrence = occurrences[in_run] = occurrences.get(in_run, -1) + 1
        cells[row] = numbers.setdefault((*key, occurrence), len(numbers))
    return cells
