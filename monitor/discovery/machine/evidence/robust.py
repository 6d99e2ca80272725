"""The first fit of a model, that no grossly wrong reading can spoil: such rows are named and get no weight.

Data without a gross reading are fitted by plain least squares, to the last bit. Else the rows are marked on the
linearised problem, before a search could run away with them, and marked anew where the fit without them stands.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from monitor.discovery.machine.fit import Fit, fit
from monitor.discovery.machine.suspects.anomalies import BadPoint
from monitor.methods.chain.gross import (
    LEAST_TIMES,
    Deviation,
    GrossReading,
    against_other_runs,
    as_reading,
    deviations,
)
from monitor.methods.chain.problem import ChainProblem

#: Marking and fitting in turn; two suffice where the errors of the machine are small.
MOST_ROUNDS = 4


@dataclass(frozen=True)
class RobustFit:
    """A fit in which the ``gross`` readings have no weight."""

    fit: Fit
    gross: tuple[GrossReading, ...]

    @property
    def points(self) -> tuple[BadPoint, ...]:
        """The gross readings as bad points; that they are right has no probability worth a number."""
        return tuple(
            BadPoint(
                reading.row, reading.run, reading.sequence, reading.target, reading.axis, reading.size,
                p_value=0.0, chi_square=reading.chi_square,
            )
            for reading in self.gross
        )  # fmt: skip


def robust_fit(problem: ChainProblem) -> RobustFit:
    """Fit a problem without its gross readings. Raises DataError where it cannot be fitted without them either."""
    gross = {row: _far_off(problem, row) for row in np.flatnonzero(problem.far_off).tolist()}
    gross |= {
        deviation.row: deviation for deviation in deviations(problem, problem.start, problem.common_start)
    }
    current = _without(problem, gross)
    for _ in range(MOST_ROUNDS):
        solution = current.solution
        more = deviations(current.problem, solution.local, solution.common)
        more += against_other_runs(current.problem, solution)
        fitting = _fitting(current, gross)
        if not more and not fitting:
            break
        gross = {row: deviation for row, deviation in gross.items() if row not in fitting}
        gross |= {deviation.row: deviation for deviation in more}
        current = _without(problem, gross)
    if not gross:
        return RobustFit(current, ())
    return RobustFit(
        current, tuple(as_reading(current.problem, current.by_error, gross[row]) for row in sorted(gross))
    )


def _far_off(problem: ChainProblem, row: int) -> Deviation:
    """A row that is no touch of its target: off by what the start leaves of it."""
    vector = problem.vectors(problem.start, problem.common_start)[row]
    return Deviation(row, tuple(map(float, vector)), np.inf)


def _without(problem: ChainProblem, gross: Mapping[int, Deviation]) -> Fit:
    marks = np.zeros(len(problem.context), dtype=bool)
    marks[list(gross)] = True
    return fit(problem, marks if gross else None)


def _fitting(current: Fit, gross: Mapping[int, Deviation]) -> set[int]:
    """Rows marked too early: where the fit stands without them, they lie as near to it as the others do."""
    limit = LEAST_TIMES * current.sigma * max(current.scale, 1.0)
    off = {row: float(np.linalg.norm(current.vectors[row])) for row in gross}
    return {
        row
        for row, deviation in gross.items()
        if np.isfinite(deviation.chi_square) and 0.0 < off[row] < limit
    }
