"""What a free-form plan cannot separate, and why: a missing boundary condition, an unseen node, the table's angles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from monitor.methods.chain.least_squares import eliminate
from monitor.methods.free_form.axes import WORKPIECE_CONDITIONS, all_conditions
from monitor.records import Array
from monitor.refusal import Advice, AdviceKind
from monitor.units import DEGREE

if TYPE_CHECKING:
    from monitor.methods.free_form.problem import FreeFormProblem

#: An angle of the table this close to a multiple of 90 degrees swaps the tables of the linear axes, in degrees.
QUARTER_DEG = 1.0


def nullity(problem: FreeFormProblem, run: int) -> int:
    """The dimension of what the readings and conditions of a run (its place) leave open, at no errors."""
    return int(np.count_nonzero(np.any(_null_space(problem)[run] != 0.0, axis=1)))


def _null_space(problem: FreeFormProblem) -> Array:
    """Scaled null vectors (R, p, p) in rows, at no errors."""
    return eliminate(problem.linearise(problem.start, problem.common_start).local).null_space


def missing_conditions(problem: FreeFormProblem) -> dict[str, str]:
    """The boundary conditions of the method that the campaign left out, each with what it fixes.

    One on the workpiece stands for one on the table's first angle: shifts for the shifts, the turn for the turn.
    """
    conditions = all_conditions(problem.plane, problem.nodes, problem.first_angle)
    shift_u, shift_v, turn = (f"{symbol}({problem.first_angle:.9g})" for symbol in problem.plane.table_terms)
    instead = dict(zip(WORKPIECE_CONDITIONS, (shift_u, shift_v, turn), strict=True))
    present = {
        *problem.held,
        problem.length.parameter,
        *(instead[condition] for condition in problem.on_shape),
    }
    return {name: meaning for name, meaning in conditions.items() if name not in present}


def advice_of(problem: FreeFormProblem, parameters: tuple[str, ...], run: int) -> Advice:
    """What the plan of a run lacks for ``parameters`` that it does not separate, and what would separate them."""
    missing = {name: meaning for name, meaning in missing_conditions(problem).items() if name in parameters}
    if missing:
        return Advice(AdviceKind.BOUNDARY_CONDITION, tuple(missing), tuple(missing.values()))
    rows = problem.context.run == run
    unseen = _unseen(problem, parameters, rows)
    if unseen:
        return Advice(AdviceKind.NO_POINT, unseen)
    table = problem.context.chain.index(problem.plane.table.name)
    degrees = np.unique(np.round(problem.context.positions[rows, table] / DEGREE.factor, 6))
    name = problem.plane.table.name
    from_first = (degrees - degrees[0] + 45.0) % 90.0 - 45.0
    if np.all(np.abs(from_first) < QUARTER_DEG):
        return Advice(AdviceKind.SWAPPED_TABLES, (name,))
    return Advice(AdviceKind.MORE_ANGLES, (name,), count=len(degrees))


def _unseen(problem: FreeFormProblem, parameters: tuple[str, ...], rows: Array) -> tuple[str, ...]:
    """The parameters that act at none of the probings."""
    local = problem.linearise(problem.start, problem.common_start).local
    index = int(np.flatnonzero(problem.runs == problem.context.run[rows][0])[0])
    size = np.linalg.norm(local[index], axis=0)
    return tuple(name for name in parameters if size[problem.local_names.index(name)] == 0.0)
