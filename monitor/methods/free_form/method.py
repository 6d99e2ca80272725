"""Free-form self-calibration: the shape of a workpiece and the errors of the axes that probe it, identified together.

The same points are probed with the rotary table at several angles. The errors of two linear axes are tables over
their travel, those of the rotary table one set an angle, the shape one number a point along the surface's normal;
what no reading fixes is fixed by eleven boundary conditions, one of them a length that was measured by other
means. Source: the self-calibration of two-dimensional free-form probing (000 in the project's papers), Eqs. (1) to
(18) and section 6, with errata E20 to E26. Signs follow docs/conventions.md: angles of the machine's errors are
right-handed, so ``ECC`` is the E_CC of the printed Eq. (13), and minus the one that counts in the sense of the
controller's clockwise C (E22).
"""

from __future__ import annotations

import numpy as np

from monitor.exceptions import DataError, TooFewReadingsError
from monitor.machine import Chain
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.free_form.assembly import NAME, problem_of
from monitor.methods.free_form.axes import plane_of
from monitor.methods.free_form.plan import candidates_of
from monitor.methods.free_form.problem import FreeFormProblem
from monitor.methods.free_form.rank import advice_of, nullity
from monitor.methods.method import AnglePlan, ChainMethod, Nouns
from monitor.records import Campaign
from monitor.refusal import Advice
from monitor.units import DEGREE

# With two angles every point has two readings, of which its own shape takes one.
FEWEST_ANGLES = 3
# A reading so far from nominal is no error of shape or machine: the frame, a sign or a target is another one.
FARTHEST_OFF = 5.0


def base_effects(chain: Chain) -> tuple[str, ...]:
    """What is free in every run; the nodes of the tables are those of each campaign."""
    plane = plane_of(chain)
    tables = [f"{symbol}:table" for symbol in (*plane.axis_terms, *plane.table_terms)]
    return (*tables, plane.squareness, "shape")


def advice(problem: ChainProblem, parameters: tuple[str, ...], run: int) -> Advice:
    """Which boundary condition is missing, or what the plan would have to do besides."""
    assert isinstance(problem, FreeFormProblem)
    return advice_of(problem, parameters, run)


def refuse(campaign: Campaign, problem: ChainProblem) -> None:
    """DataError where a run stood at fewer than three table angles, or has fewer readings than unknowns or readings
    far from nominal."""
    assert isinstance(problem, FreeFormProblem)
    _refuse_too_little(problem)
    _refuse_far_off(problem)


def _refuse_too_little(problem: FreeFormProblem) -> None:
    """DataError where a run's angles or readings are too few, by the count of Eq. (6) and by the null space."""
    table = problem.context.chain.index(problem.plane.table.name)
    for index, run in enumerate(problem.runs):
        rows = problem.context.run == run
        degrees = np.unique(np.round(problem.context.positions[rows, table] / DEGREE.factor, 6))
        points = len(np.unique(problem.context.target[rows]))
        tables = sum(len(problem.nodes[axis.name]) for axis in problem.plane.axis_terms.values())
        readings, unknowns = int(rows.sum()), points + tables + 1 + 3 * len(degrees)
        name = problem.plane.table.name
        if readings <= unknowns:
            raise TooFewReadingsError(
                f"run {run}: {points} points at {len(degrees)} angles of {name} give {readings} readings for "
                f"{unknowns} unknowns (Eq. 6); probe at more angles, or choose fewer nodes"
            )
        if len(degrees) < FEWEST_ANGLES:
            unseen = nullity(problem, index)
            conditions = len(problem.held) + len(problem.on_shape) + 1
            finding = (
                f"the null space has {unseen + conditions} dimensions, {unseen} more than the {conditions} boundary "
                "conditions fix: errors of the two linear axes that the turn maps onto each other hide in the shape"
                if unseen
                else "no combination of unknowns is quite unseen, but each point has only two readings, of which its "
                "own shape takes one: the corners of the tables alone separate shape and axes, and a single bad touch "
                "cannot be told"
            )
            raise DataError(
                f"run {run} probed at {len(degrees)} angles of {name}: {readings} readings for {unknowns} unknowns "
                f"satisfy the count of Eq. 6, which is necessary but not enough; {finding}; probe at three angles or "
                "more that are not all multiples of 90 degrees apart"
            )


def _refuse_far_off(problem: FreeFormProblem) -> None:
    off = problem.vectors(problem.start, problem.common_start)[:, 0]
    worst = int(np.abs(off).argmax())
    if abs(off[worst]) > FARTHEST_OFF:
        raise DataError(
            f"run {problem.context.run[worst]}, sequence {problem.context.sequence[worst]}: the stylus tip stands "
            f"{off[worst]:.3f} mm off the nominal point {problem.context.target[worst]} along its normal; check the "
            "frame of nominal_x_mm and normal_x (the table's, at all axes zero), the axis signs, the units "
            "(lengths are in mm) and the targets"
        )


METHOD = ChainMethod(
    name=NAME,
    title="free-form self-calibration",
    description="a workpiece of unknown shape, probed at several angles of a table",
    nouns=Nouns(target="target", row="touch"),
    problem_of=problem_of,
    refuse=refuse,
    advice=advice,
    base_effects=base_effects,
    plan=AnglePlan(candidates_of),
)
