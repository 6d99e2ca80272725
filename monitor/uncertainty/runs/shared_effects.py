"""What the coefficients that all runs share add to the outputs of one run, to first order.

Such a coefficient is one number of the campaign: it answers the readings of every run, and the run's own unknowns
answer it. With c the shared unknowns and x those of the run, c = -G sum_s M_s' r_s, where M_s is what the run's own
unknowns leave of the derivatives of run s by c, G the inverse of the sum of M_s' M_s, and x moves by D c,
D = -pinv(A) B of the whitened derivatives of the run. Residual curvature is neglected there (JCGM 102:2011, 6.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.methods.chain.least_squares import Solution, eliminate, project_out
from monitor.records import Array
from monitor.uncertainty.runs.measured_run import MeasuredRun


@dataclass(frozen=True)
class SharedAnswer:
    """How the run at ``index`` and the shared coefficients answer the inputs of all runs.

    ``response`` (p, c): the run's unknowns by the shared ones; ``by_run``: these by the inputs of every run, (c, N).
    """

    index: int
    response: Array
    by_run: tuple[Array, ...]

    def of_outputs(self, places: Sequence[int], shared: Array) -> Array:
        """Derivatives (m + a, c) by the shared coefficients of m unknowns of the run at ``places`` and of the rows
        ``shared`` (a, c) of the shared ones."""
        return np.concatenate([self.response[list(places)], shared])


def shared_answer(runs: Sequence[MeasuredRun], solution: Solution, index: int) -> SharedAnswer:
    """The answers at a ``solution`` of the problem of ``runs``, in its order."""
    count = len(solution.common)
    space = eliminate(solution.last.local)
    common = solution.last.common[..., :count]
    remainder = project_out(space.basis, common)
    by_residual = -np.einsum("ck,rmk->rcm", solution.common_covariance[:count, :count], remainder)
    answers = []
    for run, local, rows in zip(runs, solution.local, by_residual, strict=True):
        # Shorter runs are padded with zeros between their numbers and their calibrated quantities.
        extra = len(run.problem.extra_names)
        of_run = np.concatenate([rows[:, : run.problem.sigma.size], rows[:, rows.shape[1] - extra :]], axis=1)
        answers.append(run.by_inputs(local, of_run))
    response = -(space.inverse[index] @ (space.basis[index].T @ common[index]))
    return SharedAnswer(index, response, tuple(answers))
