"""Which setups drift: how their readings run with the time, beside everything that a fit knows.

A drift that the model lacks is added to the numbers of one setup in one run, in proportion to the time from its first
row to its last, and judged by one step from the joint point (score test: C. R. Rao, Proc. Camb. Phil. Soc. 44 (1948)
50). Of the column of a drift only what the unknowns of the fit do not do counts: a plan that goes one way once shows no
drift, one that comes back to its first pose does. Where the readings of a setup scatter more than it states, their own
scatter judges (Student's t); less never makes a drift surer. An effect of the machine that is missing runs with the
time too, in plans that go one way at a time; then the readings contradict each other besides, so what leaves most of
that is no drift.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import scipy

from monitor.methods.chain.least_squares import RANK_TOLERANCE, Solution
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.methods.method import SetupDrift
from monitor.records import Array

#: A drift of which the fit leaves less than this part is the same as its unknowns.
SHOWN = 0.02
#: Beside a drift the rest of a setup's readings scatters as stated, by chance at this level, or the drift is at least
#: this part of what they scatter too much.
DOUBTFUL, MOST = 0.01, 0.5


def drifts(problem: ChainProblem, solution: Solution) -> tuple[SetupDrift, ...]:
    """The drift of every number of every setup and run that could be seen, for setups that do not state one."""
    assert isinstance(problem, InstrumentProblem)
    at = problem.linearise(solution.local, solution.common)
    return tuple(
        drift
        for index, run in enumerate(problem.runs)
        for drift in _of_run(
            problem, int(run), np.hstack([at.local[index], at.common[index]]), at.residual[index]
        )
    )


def _of_run(problem: InstrumentProblem, run: int, jacobian: Array, residual: Array) -> Iterator[SetupDrift]:
    """The drifts of the setups of a run, of whitened derivatives (m, p) and residuals (m,)."""
    length = np.linalg.norm(jacobian, axis=0)
    basis, strength, _ = np.linalg.svd(jacobian / np.where(length > 0.0, length, 1.0), full_matrices=False)
    basis = basis[:, strength > RANK_TOLERANCE * strength.max(initial=0.0)]
    of_run = np.flatnonzero(problem.context.run == run)
    for part in problem.parts:
        if part.drift is not None:
            continue
        rows, elapsed = _rows_of(part, of_run)
        sigma, numbers = problem.sigma[of_run[rows]], problem.sigma.shape[1]
        read = (rows[:, None] * numbers + np.arange(numbers))[np.isfinite(sigma)]
        for number, name in enumerate(part.reading.numbers):
            column = np.zeros(len(residual))
            column[rows * numbers + number] = elapsed / sigma[:, number]
            judged = _judged(column, read, basis, residual)
            if judged is not None:
                yield SetupDrift(run, part.id, name, *judged, angular=part.reading.angular)


def _rows_of(part: Part, of_run: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.int64], Array]:
    """The places of a setup's rows among those of a run, and the time of each from 0 to 1."""
    common, of_setup, in_part = np.intersect1d(of_run, part.at, assume_unique=True, return_indices=True)
    return of_setup, part.rows.elapsed[in_part] if len(common) else np.zeros(0)


def _judged(
    column: Array, at: npt.NDArray[np.int64], basis: Array, residual: Array
) -> tuple[float, float, float] | None:
    """Size in mm, standard uncertainty and p of a drift (m,), for a setup that read the numbers ``at``; None where none
    could be seen."""
    size = float(np.linalg.norm(column))
    beside = column - basis @ (basis.T @ column)
    length = float(np.linalg.norm(beside))
    free = len(at) - float(np.sum(basis[at] ** 2)) - 1.0
    if size == 0.0 or length < SHOWN * size or free < 1.0:
        return None
    score = float(beside @ residual)
    removed = (score / length) ** 2
    remaining = max(float(np.sum(residual[at] ** 2)) - removed, 0.0)
    if scipy.special.chdtrc(free, remaining) < DOUBTFUL and removed < MOST * (remaining + removed - free):
        return None
    deviation = np.sqrt(max(1.0, remaining / free))
    p = 2.0 * float(scipy.special.stdtr(free, -abs(score) / length / deviation))
    return -score / length**2, float(deviation) / length, p
