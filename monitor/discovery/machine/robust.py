"""The first fit of a model, that no grossly wrong reading can spoil: such rows are named and get no weight.

Data without a gross reading are fitted by plain least squares, to the last bit. Else the rows are marked on the
linearised problem, before a search could run away with them, and marked anew where the fit without them stands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.anomalies import BadPoint, as_reading
from monitor.discovery.machine.fit import Fit, fit
from monitor.exceptions import DataError
from monitor.methods.chain.gross import LEAST_TIMES, GrossReading, against_other_runs, gross_readings
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
        """The gross readings as bad points: which reading is off, and by how much."""
        return tuple(_point(self.fit, reading) for reading in self.gross)


def robust_fit(problem: ChainProblem) -> RobustFit:
    """Fit a problem without its gross readings. Raises DataError where it cannot be fitted without them either."""
    gross = {reading.row: reading for reading in gross_readings(problem, problem.start, problem.common_start)}
    for row in np.flatnonzero(problem.far_off).tolist():
        gross.setdefault(row, GrossReading(row, (0.0,) * len(problem.components), np.inf))
    current = _fitted(problem, gross)
    for _ in range(MOST_ROUNDS):
        solution = current.solution
        more = gross_readings(current.problem, solution.local, solution.common)
        more += against_other_runs(current.problem, solution)
        fitting = _fitting(current, gross)
        if not more and not fitting:
            break
        gross = {row: reading for row, reading in gross.items() if row not in fitting}
        gross |= {reading.row: reading for reading in more}
        current = _fitted(problem, gross)
    return RobustFit(current, tuple(_sized(current, gross[row]) for row in sorted(gross)))


def _fitted(problem: ChainProblem, gross: dict[int, GrossReading]) -> Fit:
    return fit(problem, _marks(problem, gross) if gross else None)


def _marks(problem: ChainProblem, gross: dict[int, GrossReading]) -> npt.NDArray[np.bool_]:
    marks = np.zeros(len(problem.context), dtype=bool)
    marks[list(gross)] = True
    return marks


def _fitting(current: Fit, gross: dict[int, GrossReading]) -> set[int]:
    """Rows marked too early: the fit without them comes as close to them as to others."""
    rows = [row for row, reading in gross.items() if np.isfinite(reading.chi_square)]
    near = np.linalg.norm(current.vectors[rows], axis=1) < LEAST_TIMES * current.sigma * max(current.scale, 1.0)
    determined = np.linalg.norm(current.vectors[rows], axis=1) > 0.0
    return {row for row, is_near, has_residual in zip(rows, near, determined, strict=True) if is_near and has_residual}


def _sized(current: Fit, reading: GrossReading) -> GrossReading:
    return reading


def _point(under: Fit, reading: GrossReading) -> BadPoint:
    context, row = under.problem.context, reading.row
    vector = np.array(reading.vector)
    axis, size = as_reading(under, row, vector)
    return BadPoint(
        row=row,
        run=int(context.run[row]),
        sequence=int(context.sequence[row]),
        target=str(context.target[row]),
        axis=axis,
        size=size,
        p_value=0.0,
        chi_square=reading.chi_square,
    )
