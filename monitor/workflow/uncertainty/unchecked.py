"""Readings of a single run that no other reading checks: a wrong one shows in no residual, and in nothing else.

A direction of a row of which the fit leaves nothing has no redundancy (W. Baarda, A Testing Procedure for Use in
Geodetic Networks, 1968). Of repeated runs the other runs check it.
"""

from __future__ import annotations

import numpy as np

from monitor.discovery import Fit
from monitor.reporting.budget import Unchecked

#: What the fit leaves of a direction (squared) below which nothing checks it. Of `five-days` the least is 0.67 else.
_LEFT = 1e-6
#: A reading that moves a parameter by less than this part of its u, for one standard deviation of itself, does not
#: count: such a part may be ten standard deviations off, and is still within u.
_MOVES = 0.1
#: Directions of the unknowns that the readings determine worse than this, relative to the best, are none.
_DETERMINED = 1e-9


def unchecked_readings(fit: Fit, names: tuple[str, ...]) -> Unchecked | None:
    """The readings of the one run of a fit that nothing checks, and which of its parameters ``names`` they move.

    None where every reading is checked, where what is not checked moves nothing, or of several runs.
    """
    problem, last = fit.problem, fit.solution.last
    if len(problem.runs) > 1:
        return None
    columns = np.concatenate([last.local[0], last.common[0]], axis=1)
    size = np.linalg.norm(columns, axis=0)
    size = np.where(size == 0.0, 1.0, size)
    basis, values, right = np.linalg.svd(columns / size, full_matrices=False)
    able = values > _DETERMINED * values[0]
    basis = basis[:, able]
    columns_of_names = [problem.base_names.index(name) for name in names if name in problem.base_names]
    inverse = (right[able].T / values[able])[columns_of_names] @ basis.T / size[columns_of_names, None]
    u = np.sqrt(np.sum(inverse**2, axis=1))
    numbers = problem.sigma.shape[1]
    rows, shares = [], np.zeros(len(columns_of_names))
    for row in np.flatnonzero(fit.has_weight.any(axis=1)):
        read = row * numbers + np.flatnonzero(fit.has_weight[row])
        part_left, directions = np.linalg.eigh(np.eye(len(read)) - basis[read] @ basis[read].T)
        moved = np.abs(inverse[:, read] @ directions[:, part_left < _LEFT]).max(axis=1, initial=0.0) / u
        if np.any(moved > _MOVES):
            rows.append(int(problem.context.sequence[row]))
            shares = np.maximum(shares, moved)
    if not rows:
        return None
    by_share = [output for output in np.argsort(-shares, kind="stable") if shares[output] > _MOVES]
    return Unchecked(tuple(rows), tuple(problem.base_names[columns_of_names[output]] for output in by_share))
