"""The least-squares problem of free-form probing: rows along a normal, and derivatives at the nominal points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from monitor.effects import parse_effect
from monitor.effects.artefact import normals_of
from monitor.effects.effect import ChainBasis
from monitor.effects.shapes import nodes_text
from monitor.machine import Evaluation, Term, evaluate, parse_term
from monitor.methods.free_form_axes import WORKPIECE_CONDITIONS, Plane, all_conditions, at
from monitor.methods.least_squares import Linearisation
from monitor.methods.problem import ChainProblem
from monitor.records import Array, KnownError

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
