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

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from monitor.effects import context_of, parse_effect
from monitor.effects.artefact import normals_of
from monitor.effects.effect import ChainBasis
from monitor.effects.shapes import nodes_text
from monitor.exceptions import DataError
from monitor.machine import Evaluation, Term, evaluate, parse_term
from monitor.methods.free_form_axes import (
    WORKPIECE_CONDITIONS,
    Plane,
    all_conditions,
    at,
    base_texts,
    plane_of,
)
from monitor.methods.free_form_rank import nullity, reason_of
from monitor.methods.identification import Identification
from monitor.methods.least_squares import Linearisation
from monitor.methods.model import Model, chain_of
from monitor.methods.problem import ChainProblem, solve_problem
from monitor.methods.results import identification
from monitor.records import Array, Campaign, KnownError
from monitor.units import DEGREE

NAME = "free-form"
DEFAULT_MODEL = Model("free-form")
# With two angles every point has two readings, of which its own shape takes one.
FEWEST_ANGLES = 3
# A reading so far from nominal is no error of shape or machine: the frame, a sign or a target is another one.
FARTHEST_OFF = 5.0
# A condition on the shape enters as a reading of this part of a probing's uncertainty: the shape's own uncertainty
# grows by less than 1e-3 of itself, and the triangle of the least squares stays well scaled.
CONDITION_SHARE = 1e-2


@dataclass(frozen=True)
class FreeFormProblem(ChainProblem):
    """Probings along a normal. A run's own unknown is the error that was measured by other means, ``length``.

    ``held`` are the parameters that are zero by choice, ``on_shape`` the conditions that fix the frame in the
    workpiece. ``known`` (R,) is the value of ``length`` in mm, one a run.
    """

    plane: Plane
    length: KnownError
    known: Array
    held: tuple[str, ...]
    on_shape: tuple[str, ...]
    nodes: dict[str, tuple[float, ...]]
    first_angle: float

    @property
    def own_names(self) -> tuple[str, ...]:
        """The known error."""
        return (self.length.parameter,)

    @property
    def own_start(self) -> Array:
        """The known error at its value (R, 1)."""
        return self.known[:, None].copy()

    @cached_property
    def _length_effect(self) -> tuple[Term, Array]:
        """Which error is the known one, and the part of it (n,) that acts at every probing."""
        symbol, _, rest = self.length.parameter.partition("(")
        chain = self.context.chain
        nodes = self.nodes[chain.joints[parse_term(symbol, chain).joint].name]
        only = nodes_text(nodes, [place for place in nodes if at("", place) != f"({rest}"])
        basis = parse_effect(f"{symbol}:{only}", chain).basis(self.context)
        assert isinstance(basis, ChainBasis)
        return basis.term, basis.columns[:, 0]

    @property
    def components(self) -> tuple[str, ...]:
        """One number a probing."""
        return ("normal",)

    @property
    def measured_joints(self) -> tuple[int, ...]:
        """The two linear axes in the plane."""
        chain = self.context.chain
        return tuple(sorted(chain.index(joint.name) for joint in (self.plane.u, self.plane.v)))

    @property
    def extra_names(self) -> tuple[str, ...]:
        """The known error."""
        return (f"known {self.length.parameter}",)

    @cached_property
    def normals(self) -> Array:
        """Unit normals (n, 3) of the surface, in the frame of the workpiece."""
        return normals_of(self.context)

    def ends(self, own: Array) -> tuple[Array, Array]:
        """The nominal point and the stylus tip on the axis of the spindle."""
        return self.context.nominal.copy(), np.zeros((len(self.context), 3))

    def observe(self, rows: Array) -> Array:
        """Along the normal (Eq. 3): (n, 3, ...) to (n, 1, ...)."""
        told: Array = np.einsum("ni,ni...->n...", self.normals, rows)[:, None]
        return told

    def state(self, local: Array, common: Array) -> tuple[Array, Array, Array]:
        """Errors (n, J, 2, 6), points (n, 3) and tips (n, 3); the known error joins those of its axis."""
        errors, target, tip = super().state(local, common)
        term, hat = self._length_effect
        errors[:, term.joint, term.stage, term.component] += self.own_of(local)[self._run, 0] * hat
        return errors, target, tip

    def by_own(self, own: Array, seen: Evaluation) -> Array:
        """Derivatives (n, 3, 1) by the known error."""
        assert seen.by_error is not None
        term, hat = self._length_effect
        found: Array = (seen.by_error[:, :, term.joint, term.stage, term.component] * hat[:, None])[..., None]
        return found

    def extras(self, own: Array) -> tuple[Array, Array]:
        """The known error less its value, in its standard uncertainty."""
        u = self.length.standard_uncertainty
        return (own - self.known[:, None]) / u, np.full((len(self.runs), 1, 1), 1.0 / u)

    @cached_property
    def _shape_rows(self) -> Array:
        """Rows (R, k, p) of the conditions on the shape: no shift along u, v and no turn of the whole shape."""
        places = {name: place for place, name in enumerate(self.local_names)}
        u, v = (np.array(joint.direction) for joint in (self.plane.u, self.plane.v))
        w = np.cross(u, v)
        moved = {
            "shape shift u": np.broadcast_to(u, self.context.nominal.shape),
            "shape shift v": np.broadcast_to(v, self.context.nominal.shape),
            "shape turn": np.cross(w, self.context.nominal),
        }
        rows = np.zeros((len(self.runs), len(self.on_shape), len(self.local_names)))
        for place, condition in enumerate(self.on_shape):
            along = np.einsum("ni,ni->n", moved[condition], self.normals)
            for row, target in enumerate(self.context.target):
                rows[self._run[row], place, places[f"shape({target})"]] = along[row]
        size = np.linalg.norm(rows, axis=-1, keepdims=True) * CONDITION_SHARE * float(self.sigma.min())
        scaled: Array = rows / np.where(size > 0.0, size, 1.0)
        return scaled

    @cached_property
    def nominal(self) -> FreeFormProblem:
        """The same probings where a machine without errors would have met the nominal points.

        There the null vectors are exact. At the readings themselves errors of 50 µrad and 10 µm leave products of
        second order, 1e-4 of a column, which no tolerance would tell from a plan that barely sees an unknown.
        """
        chain, positions = self.context.chain, self.context.positions.copy()
        none = np.zeros((len(self.context), len(chain.joints), 2, 6))
        target, tip = self.ends(self.own_start)
        seen = evaluate(chain, positions, none, target, tip)
        off = np.einsum("nij,nj->ni", seen.work_rotation, seen.residual)
        for joint in (self.plane.u, self.plane.v):
            along = off @ np.array(joint.direction)
            positions[:, chain.index(joint.name)] += along if joint.branch == "work" else -along
        return replace(self, context=replace(self.context, positions=positions))

    @cached_property
    def _design(self) -> tuple[Array, Array]:
        """Derivatives (R, N, p) and (R, N, c) at the nominal points, the conditions on the shape in the last rows."""
        at_nominal = ChainProblem.linearise(self.nominal, self.nominal.start, self.common_start)
        return self._with_conditions(at_nominal.local, at_nominal.common)

    def _with_conditions(self, local: Array, common: Array) -> tuple[Array, Array]:
        rows = self._shape_rows
        none = np.zeros((*rows.shape[:2], common.shape[2]))
        return np.concatenate([local, rows], axis=1), np.concatenate([common, none], axis=1)

    def linearise(self, local: Array, common: Array) -> Linearisation:
        """Whitened residuals, exact, and the derivatives at the nominal points, as Eq. (15) has them.

        So the least-squares point is J0' r = 0 with the constant J0 of the method; against J(x)' r = 0 it differs by
        1e-4 of the residuals' share. Conditions on the shape stand after the known error.
        """
        told = self.vectors(local, common) / self.sigma
        extra, _ = self.extras(self.own_of(local))
        on_shape = np.einsum("rkp,rp->rk", self._shape_rows, local)
        by_local, by_common = self._design
        if any(added.searched for added in self.shared):
            at_nominal = ChainProblem.linearise(self.nominal, self.nominal.start, common)
            by_local, by_common = self._with_conditions(at_nominal.local, at_nominal.common)
        return Linearisation(
            np.concatenate([self.padded(told), extra, on_shape], axis=1), by_local, by_common
        )

    @property
    def conditions(self) -> dict[str, str]:
        """Every condition of this problem with what it fixes, the known error last."""
        known = all_conditions(self.plane, self.nodes, self.first_angle)
        words = dict(zip(WORKPIECE_CONDITIONS, ("shift along u", "shift along v", "turn"), strict=True))
        chosen = {name: known.get(name, "chosen by the campaign") for name in self.held}
        chosen |= {name: f"the shape as a whole has no {words[name]}" for name in self.on_shape}
        return chosen | {self.length.parameter: known.get(self.length.parameter, "the unit of length")}


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
        raise DataError(f"campaign {campaign.name} says no nodes; free-form needs [artefact.self_calibration]")
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
        raise DataError(f"{length.parameter} is both a condition and the known length; take it out of conditions")
    texts = model.base or base_texts(plane, calibration, angles, {*held, length.parameter})
    symbol = length.parameter.partition("(")[0]
    if symbol not in plane.axis_terms:
        raise DataError(
            f"[artefact.self_calibration.length] parameter: {length.parameter} gives no unit of length; name the error "
            f"of a linear axis, such as {at(plane.term(plane.u, plane.u), nodes[plane.u.name][-1])}"
        )
    whole = Model(model.name, texts, model.added)
    return FreeFormProblem(
        context=context_of(campaign, chain),
        base=whole.base_of(chain),
        added=whole.added_to(chain),
        sigma=np.full((len(campaign.probings), 1), campaign.probe.standard_uncertainty),
        plane=plane,
        length=length,
        known=np.full(len(np.unique(campaign.probings.run)), length.value),
        held=held,
        on_shape=on_shape,
        nodes=nodes,
        first_angle=first_angle,
    )


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


def identify(campaign: Campaign, model: Model = DEFAULT_MODEL) -> Identification:
    """Shape and errors of every run of a campaign, with the covariance of the probe's and the length's uncertainty.

    Raises DataError where a run stood at fewer than three table angles, has fewer readings than unknowns or
    readings far from nominal; EffectError where the model names an effect that the machine does not have.
    """
    problem = problem_of(campaign, model)
    refuse_too_little(problem)
    _refuse_far_off(problem)
    solution = solve_problem(problem)
    return identification(campaign, model, problem, solution, advice)


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
                else "no combination of unknowns is quite unseen, but each point has only two readings, of which its own "
                "shape takes one: the corners of the tables alone separate shape and axes, and a single bad touch "
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
            "frame of nominal_x_mm and normal_x (the table's, at all axes zero), the axis signs and the order of targets"
        )
