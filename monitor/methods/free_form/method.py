"""Free-form self-calibration: the shape of a workpiece and the errors of the axes that probe it, found together.

The same points are probed with the rotary table at several angles. The errors of two linear axes are tables over
their travel, those of the rotary table one set an angle, the shape one number a point along the surface's normal;
what no reading fixes is fixed by eleven boundary conditions, one of them a length that was measured by other
means. Source: the self-calibration of two-dimensional free-form probing (000 in the project's papers), Eqs. (1) to
(18) and section 6, with errata E20 to E26. Signs follow docs/conventions.md: angles of the machine's errors are
right-handed, so ``ECC`` is the E_CC of the printed Eq. (13), and minus the one that counts in the sense of the
controller's clockwise C (E22).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from monitor.effects import context_of
from monitor.exceptions import DataError
from monitor.machine import Chain
from monitor.methods.chain.identification import Identification
from monitor.methods.chain.problem import ChainProblem, Solver, solve_problem
from monitor.methods.chain.results import identification
from monitor.methods.free_form.axes import WORKPIECE_CONDITIONS, all_conditions, at, base_texts, plane_of
from monitor.methods.free_form.problem import FreeFormProblem
from monitor.methods.free_form.rank import nullity, reason_of
from monitor.methods.model import Model, chain_of
from monitor.records import Campaign
from monitor.units import DEGREE

NAME = "free-form"
DEFAULT_MODEL = Model("free-form")
# With two angles every point has two readings, of which its own shape takes one.
FEWEST_ANGLES = 3
# A reading so far from nominal is no error of shape or machine: the frame, a sign or a target is another one.
FARTHEST_OFF = 5.0


def base_effects(chain: Chain) -> tuple[str, ...]:
    """What is free in every run; the nodes of the tables are those of each campaign."""
    plane = plane_of(chain)
    tables = [f"{symbol}:table" for symbol in (*plane.axis_terms, *plane.table_terms)]
    return (*tables, plane.squareness, "shape")


def angles_of(campaign: Campaign, table: str) -> tuple[float, ...]:
    """The readings of the table in degrees at which the campaign probed, in rising order."""
    degrees = np.round(campaign.probings.readings[table] / DEGREE.factor, 6)
    return tuple(float(angle) for angle in np.unique(degrees))


def problem_of(campaign: Campaign, model: Model = DEFAULT_MODEL) -> FreeFormProblem:
    """The least-squares problem of a campaign under a model.

    Every probing has the probe's stated standard uncertainty along the normal. Raises DataError where the machine
    has no table across two linear axes, or the campaign names nodes or conditions that there are not.
    """
    calibration = campaign.artefact.self_calibration
    if calibration is None:
        raise DataError(
            f"campaign {campaign.name} says no nodes; free-form needs [artefact.self_calibration]"
        )
    chain = chain_of(campaign.machine)
    plane = plane_of(chain)
    for axis in (plane.u.name, plane.v.name):
        if axis not in calibration.nodes:
            raise DataError(f"[artefact.self_calibration.nodes_mm] lacks axis {axis}; list its nodes in mm")
    angles = angles_of(campaign, plane.table.name)
    first_angle = float(np.round(campaign.probings.readings[plane.table.name][0] / DEGREE.factor, 6))
    nodes = {axis: tuple(places) for axis, places in calibration.nodes.items()}
    places = {symbol: nodes[axis.name] for symbol, axis in plane.axis_terms.items()}
    places |= dict.fromkeys(plane.table_terms, angles)
    there = {at(symbol, place) for symbol, of_it in places.items() for place in of_it}
    length = replace(calibration.length, parameter=_known(calibration.length.parameter, there, "length"))
    chosen = calibration.conditions or tuple(
        name for name in all_conditions(plane, nodes, first_angle) if name != length.parameter
    )
    on_shape = tuple(name for name in chosen if name in WORKPIECE_CONDITIONS)
    held = tuple(_known(name, there, "conditions") for name in chosen if name not in on_shape)
    if length.parameter in held:
        raise DataError(
            f"{length.parameter} is both a condition and the known length; take it out of conditions"
        )
    texts = model.base or base_texts(plane, calibration, angles, {*held, length.parameter})
    symbol = length.parameter.partition("(")[0]
    if symbol not in plane.axis_terms:
        raise DataError(
            f"[artefact.self_calibration.length] parameter: {length.parameter} gives no unit of length; name the error "
            f"of a linear axis, such as {at(plane.term(plane.u, plane.u), nodes[plane.u.name][-1])}"
        )
    whole = Model(model.name, texts, model.added)
    problem = FreeFormProblem(
        context=context_of(campaign, chain),
        base=whole.base_of(chain),
        added=whole.added_to(chain),
        sigma=np.full((len(campaign.probings), 1), campaign.probe.standard_uncertainty),
        plane=plane,
        length=length,
        known=np.full(len(campaign.probings), length.value),
        held=held,
        on_shape=on_shape,
        nodes=nodes,
        first_angle=first_angle,
    )
    return problem.foreseen() if problem.added else problem


def _known(name: str, there: set[str], where: str) -> str:
    plain = name.replace(" ", "")
    if plain not in there:
        near = sorted(one for one in there if one.partition("(")[0] == plain.partition("(")[0])
        raise DataError(
            f"[artefact.self_calibration] {where}: there is no parameter '{name}'; write for example "
            f"{', '.join(near[:3] or sorted(there)[:3])} or one of {', '.join(WORKPIECE_CONDITIONS)}"
        )
    return plain


def advice(problem: ChainProblem, parameters: tuple[str, ...], run: int) -> str:
    """Which boundary condition is missing, or what the plan would have to do besides."""
    assert isinstance(problem, FreeFormProblem)
    return reason_of(problem, parameters, run)


def identify(
    campaign: Campaign, model: Model = DEFAULT_MODEL, solve: Solver = solve_problem
) -> Identification:
    """Shape and errors of every run of a campaign, with the covariance of the probe's and the length's uncertainty.

    Raises DataError where a run stood at fewer than three table angles, has fewer readings than unknowns or
    readings far from nominal; EffectError where the model names an effect that the machine does not have.
    """
    problem = problem_of(campaign, model)
    refuse_too_little(problem)
    _refuse_far_off(problem)
    return identification(campaign, model, problem, solve(problem), advice)


def refuse_too_little(problem: FreeFormProblem) -> None:
    """DataError where a run's angles or readings are too few, by the count of Eq. (6) and by the null space."""
    table = problem.context.chain.index(problem.plane.table.name)
    for place, run in enumerate(problem.runs):
        rows = problem.context.run == run
        degrees = np.unique(np.round(problem.context.positions[rows, table] / DEGREE.factor, 6))
        points = len(np.unique(problem.context.target[rows]))
        tables = sum(len(problem.nodes[axis.name]) for axis in problem.plane.axis_terms.values())
        readings, unknowns = int(rows.sum()), points + tables + 1 + 3 * len(degrees)
        name = problem.plane.table.name
        if readings <= unknowns:
            raise DataError(
                f"run {run}: {points} points at {len(degrees)} angles of {name} give {readings} readings for "
                f"{unknowns} unknowns (Eq. 6); probe at more angles, or choose fewer nodes"
            )
        if len(degrees) < FEWEST_ANGLES:
            left = nullity(problem, place)
            conditions = len(problem.held) + len(problem.on_shape) + 1
            found = (
                f"the null space has {left + conditions} dimensions, {left} more than the {conditions} boundary "
                "conditions fix: errors of the two linear axes that the turn maps onto each other hide in the shape"
                if left
                else "no combination of unknowns is quite unseen, but each point has only two readings, of which its "
                "own shape takes one: the corners of the tables alone separate shape and axes, and a single bad touch "
                "cannot be told"
            )
            raise DataError(
                f"run {run} probed at {len(degrees)} angles of {name}: {readings} readings for {unknowns} unknowns "
                f"satisfy the count of Eq. 6, which is necessary but not enough; {found}; probe at three angles or "
                "more that are not all multiples of 90 degrees apart"
            )


def _refuse_far_off(problem: FreeFormProblem) -> None:
    off = problem.vectors(problem.start, problem.common_start)[:, 0]
    worst = int(np.abs(off).argmax())
    if abs(off[worst]) > FARTHEST_OFF:
        raise DataError(
            f"run {problem.context.run[worst]}, sequence {problem.context.sequence[worst]}: the stylus tip stands "
            f"{off[worst]:.3f} mm off the nominal point {problem.context.target[worst]} along its normal; check the "
            "frame of nominal_x_mm and normal_x (the table's, at all axes zero), the axis signs and the targets"
        )
