"""A row that is off, by how much, and which touch of the plan it is: what the ways to find such rows share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.methods.chain.problem import ChainProblem

#: A gross row is off by so many stated standard uncertainties: where nothing but rounding is left, some row is largest.
LEAST_TIMES = 8.0
#: More than so many rows of one run, and this part of them, are no single mistakes.
MOST_ROWS, MOST_PART = 10, 0.1
#: So many runs with the same targets are needed before the others say that one is wrong.
FEWEST_RUNS = 3


@dataclass(frozen=True)
class Deviation:
    """How far a row is off: ``vector`` (d,) mm of the d numbers that it tells, ``chi_square`` in stated standard
    uncertainties.

    Of a touch that stands elsewhere on its surface the vector is the whole (3,), and no number measures it: infinite.
    ``others`` are rows of the same run that explain the same residual as well: the plan cannot say which it was.
    ``moves`` says by how many standard uncertainties the row, or the worst of these, moves the geometric error that it
    moves most, in the linear model of its run; None where the run's own unknowns follow it.
    """

    row: int
    vector: tuple[float, ...]
    chi_square: float
    others: tuple[int, ...] = ()
    moves: float | None = None


def plan_touches(problem: ChainProblem, posed: Sequence[int] | None = None) -> npt.NDArray[np.int64]:
    """The touch of the plan (n,) that every row is: the same number for the same target, pose and occurrence.

    The pose is that of the joints ``posed``, else of all that are not measured.
    """
    context = problem.context
    if posed is None:
        measured = problem.measured_joints
        posed = [joint for joint in range(len(context.chain.joints)) if joint not in measured]
    poses = np.round(context.positions[:, posed], 6) + 0.0
    numbers: dict[tuple[object, ...], int] = {}
    counted: dict[tuple[object, ...], int] = {}
    touches = np.empty(len(context), dtype=np.int64)
    for row in range(len(context)):
        key = (str(context.target[row]), *poses[row].tolist())
        in_run = (int(context.run[row]), *key)
        counted[in_run] = counted.get(in_run, -1) + 1
        touches[row] = numbers.setdefault((*key, counted[in_run]), len(numbers))
    return touches
