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
from monitor.exceptions import DataError
from monitor.methods.chain.along_surface import along_surface
from monitor.methods.chain.deviation import FEWEST_RUNS, LEAST_TIMES, Deviation
from monitor.methods.chain.gross import GrossReading, against_other_runs, as_reading, deviations
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
    # After those, whose number tells by how much alone: a touch that stands elsewhere tells by which reading too.
    gross |= {deviation.row: deviation for deviation in along_surface(problem)}
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
    certain = _without_innocent(problem, gross)
    if len(certain) < len(gross):
        current = _without(problem, certain)
    return RobustFit(
        current, tuple(as_reading(current.problem, current.by_error, certain[row]) for row in sorted(certain))
    )


def _far_off(problem: ChainProblem, row: int) -> Deviation:
    """A row that is no touch of its target: off by what the start leaves of it."""
    vector = problem.vectors(problem.start, problem.common_start)[row]
    return Deviation(row, tuple(map(float, vector)), np.inf)


def _without(problem: ChainProblem, gross: Mapping[int, Deviation]) -> Fit:
    marks = np.zeros(len(problem.context), dtype=bool)
    marks[list(gross)] = True
    return fit(problem, marks if gross else None)


def _without_innocent(problem: ChainProblem, gross: dict[int, Deviation]) -> dict[int, Deviation]:
    """The gross rows, less those that nothing speaks against once the others of their run have no weight.

    One ball of a bar that is touched once a run and stands 30 mm off makes the bar's length wrong: before the other
    runs are asked, the ball at its other end is as likely to be the wrong one.
    """
    if problem.moved_together is None or len(problem.runs) < FEWEST_RUNS:
        return gross
    runs, certain = problem.context.run, dict(gross)
    for row in sorted(gross, key=lambda row: gross[row].chi_square):
        beside = {other: deviation for other, deviation in certain.items() if other != row}
        if not np.isfinite(gross[row].chi_square) or runs[row] not in runs[list(beside)]:
            continue
        try:
            current = _without(problem, beside)
        except (DataError, np.linalg.LinAlgError):
            continue
        solution = current.solution
        again = [
            *deviations(current.problem, solution.local, solution.common),
            *against_other_runs(current.problem, solution),
        ]
        by_row = {deviation.row: deviation for deviation in again}
        # How far it is off was taken from a bar of which both balls are wrong, where both are.
        certain = {**certain, row: by_row[row]} if row in by_row else beside
    return certain


def _fitting(current: Fit, gross: Mapping[int, Deviation]) -> set[int]:
    """Rows marked too early: where the fit stands without them, they lie as near to it as the others do."""
    limit = LEAST_TIMES * current.sigma * max(current.scale, 1.0)
    off = {row: float(np.linalg.norm(current.vectors[row])) for row in gross}
    return {
        row
        for row, deviation in gross.items()
        if np.isfinite(deviation.chi_square) and 0.0 < off[row] < limit
    }
