"""The least-squares problem of free-form probing: rows along a normal, and derivatives at the nominal points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from monitor.effects import ChainEffect, parse_effect
from monitor.effects.artefact import normals_of
from monitor.effects.shapes import nodes_text
from monitor.machine import ChainPose, Term, evaluate, parse_term
from monitor.methods.chain.least_squares import Linearisation
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.free_form.axes import WORKPIECE_CONDITIONS, Plane, all_conditions, at
from monitor.records import Array, KnownError

# A condition on the shape enters as a reading of this part of a probing's uncertainty: the shape's own uncertainty
# grows by less than 1e-3 of itself, and the triangle of the least squares stays well scaled.
CONDITION_SHARE = 1e-2


@dataclass(frozen=True)
class FreeFormProblem(ChainProblem):
    """Probings along a normal. A run's own unknown is the error that was measured by other means, ``length``.

    ``held`` are the parameters that are zero by choice, ``on_shape`` the conditions that fix the frame in the
    workpiece. ``length_at_rows`` (n,) is the value of ``length`` in mm, the same for all rows of a run.
    """

    plane: Plane
    length: KnownError
    length_at_rows: Array
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
        _, first = np.unique(self._run, return_index=True)
        return self.length_at_rows[first, None].copy()

    @property
    def known_errors(self) -> tuple[tuple[ChainEffect, str], ...]:
        """The known error, at its node."""
        symbol, _, rest = self.length.parameter.partition("(")
        chain = self.context.chain
        nodes = self.nodes[chain.joints[parse_term(symbol, chain).joint].name]
        only = nodes_text(nodes, [position for position in nodes if at("", position) != f"({rest}"])
        effect = parse_effect(f"{symbol}:{only}", chain)
        assert isinstance(effect, ChainEffect)
        return ((effect, self.length.parameter),)

    @cached_property
    def _length_effect(self) -> tuple[Term, Array]:
        """Which error is the known one, and the part of it (n,) that acts at every probing."""
        basis = self.known_errors[0][0].basis(self.context)
        return basis.term, basis.columns[:, 0]

    @property
    def touch_normals(self) -> Array:
        """The normals."""
        return self.normals

    @property
    def standard_lengths(self) -> Array:
        """From the node where the known error is zero to its own, in its standard uncertainties; nothing else grows."""
        symbol, _, node = self.length.parameter.rstrip(")").partition("(")
        zeros = [
            float(name.rstrip(")").partition("(")[2]) for name in self.held if name.startswith(f"{symbol}(")
        ]
        from_zero = float(node) - (min(zeros, key=abs) if zeros else 0.0)
        return np.array([from_zero / self.length.standard_uncertainty, *(0.0 for _ in self.on_shape)])

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
        """The known error, then the conditions on the shape."""
        return (f"known {self.length.parameter}", *self.on_shape)

    @cached_property
    def normals(self) -> Array:
        """Unit normals (n, 3) of the surface, in the frame of the workpiece."""
        return normals_of(self.context)

    def ends(self, nuisance: Array) -> tuple[Array, Array]:
        """The nominal point and the stylus tip on the axis of the spindle."""
        return self.context.nominal.copy(), np.zeros((len(self.context), 3))

    def observe(self, rows: Array) -> Array:
        """Along the normal (Eq. 3): (n, 3, ...) to (n, 1, ...)."""
        along_normal: Array = np.einsum("ni,ni...->n...", self.normals, rows)[:, None]
        return along_normal

    def by_own(self, nuisance: Array, pose: ChainPose) -> Array:
        """Derivatives (n, 3, 1) by the known error."""
        assert pose.by_error is not None
        term, hat = self._length_effect
        derivative: Array = (pose.by_error[:, :, term.joint, term.stage, term.component] * hat[:, None])[
            ..., None
        ]
        return derivative

    def extras(self, nuisance: Array) -> tuple[Array, Array]:
        """The known error less its value, in its standard uncertainty."""
        u = self.length.standard_uncertainty
        return (nuisance - self.own_start) / u, np.full((len(self.runs), 1, 1), 1.0 / u)

    @cached_property
    def _shape_rows(self) -> Array:
        """Rows (R, k, p) of the conditions on the shape: no shift along u, v and no turn of the whole shape."""
        places = {name: index for index, name in enumerate(self.local_names)}
        u, v = (np.array(joint.direction) for joint in (self.plane.u, self.plane.v))
        w = np.cross(u, v)
        moved = {
            "shape shift u": np.broadcast_to(u, self.context.nominal.shape),
            "shape shift v": np.broadcast_to(v, self.context.nominal.shape),
            "shape turn": np.cross(w, self.context.nominal),
        }
        rows = np.zeros((len(self.runs), len(self.on_shape), len(self.local_names)))
        for index, condition in enumerate(self.on_shape):
            along = np.einsum("ni,ni->n", moved[condition], self.normals)
            for row, target in enumerate(self.context.target):
                rows[self._run[row], index, places[f"shape({target})"]] = along[row]
        size = np.linalg.norm(rows, axis=-1, keepdims=True) * CONDITION_SHARE * float(self.sigma.min())
        scaled: Array = rows / np.where(size > 0.0, size, 1.0)
        return scaled

    @cached_property
    def nominal(self) -> FreeFormProblem:
        """The same probings where a machine without errors would have met the nominal points.

        There the null vectors are exact. At the readings themselves errors of 50 µrad and 10 µm leave products of
        second order, 1e-4 of a column, which no tolerance would separate from a plan that barely determines an unknown.
        """
        chain, positions = self.context.chain, self.context.positions.copy()
        none = np.zeros((len(self.context), len(chain.joints), 2, 6))
        target, tip = self.ends(self.own_start)
        pose = evaluate(chain, positions, none, target, tip)
        off = np.einsum("nij,nj->ni", pose.work_rotation, pose.residual)
        for joint in (self.plane.u, self.plane.v):
            along = off @ np.array(joint.direction)
            positions[:, chain.index(joint.name)] += along if joint.branch == "work" else -along
        return replace(self, context=replace(self.context, positions=positions, expected=None))

    def foreseen(self) -> FreeFormProblem:
        """Added effects look at the nominal points too, as the tables do."""
        if self.context.expected is not None:
            return self
        return replace(self, context=self.context.expecting(self.nominal.context.positions))

    @cached_property
    def _at_nominal(self) -> ChainPose:
        """The derivatives of the vectors at the nominal points, at no errors."""
        nominal = self.nominal
        none = np.zeros((len(self.context), len(self.context.chain.joints), 2, 6))
        ends = self.ends(self.own_start)
        return evaluate(self.context.chain, nominal.context.positions, none, *ends, jacobian=True)

    @cached_property
    def as_read(self) -> Array:
        """The residuals (n, 1) in mm of a machine and workpiece without errors, exactly (Eq. 3)."""
        none = np.zeros((len(self.context), len(self.context.chain.joints), 2, 6))
        ends = self.ends(self.own_start)
        return self.observe(evaluate(self.context.chain, self.context.positions, none, *ends).residual)

    @cached_property
    def _rows(self) -> Array:
        """Derivatives (n, 1, p) of a row by the unknowns of its run: Eqs. (7), (12) and (13)."""
        pose, nominal = self._at_nominal, self.nominal
        assert pose.by_error is not None
        parts = [effect.basis(nominal.context).displacement(pose.by_error) for effect in self.base]
        return np.concatenate(
            [*map(self.observe, parts), self.observe(nominal.by_own(self.own_start, pose))], axis=-1
        )

    @cached_property
    def _design(self) -> Array:
        """Whitened derivatives (R, N, p) of all rows, of the known error and of the conditions on the shape."""
        _, by_extra = self.extras(self.own_start)
        before = ((0, 0), (0, 0), (len(self.base_names), 0))
        return np.concatenate(
            [self.padded(self._rows / self.sigma[..., None]), np.pad(by_extra, before), self._shape_rows],
            axis=1,
        )

    def vectors(self, local: Array, common: Array) -> Array:
        """Residuals (n, 1) in mm: what was read, and what the errors do to it at the nominal points (Eq. 14)."""
        by_error = self._at_nominal.by_error
        assert by_error is not None
        vectors: Array = self.as_read + np.einsum("nip,np->ni", self._rows, local[self._run])
        for moved in self.observed_displacements(common, by_error):
            vectors = vectors + moved
        return vectors

    def linearise(self, local: Array, common: Array) -> Linearisation:
        """Whitened residuals and derivatives. The model is linear, as Eq. (15) has it, with its rows from the chain.

        Neglected: errors times errors, and a place off nominal times the slope of a table (10 µm and 5 µm over
        22 mm: 2 nm). Conditions on the shape stand after the known error.
        """
        extra, _ = self.extras(self.own_of(local))
        on_shape = np.einsum("rkp,rp->rk", self._shape_rows, local)
        residual = [self.padded(self.vectors(local, common) / self.sigma), extra, on_shape]
        return Linearisation(np.concatenate(residual, axis=1), self._design, self._by_common(common))

    def _by_common(self, common: Array) -> Array:
        by_error = self._at_nominal.by_error
        assert by_error is not None
        rows = self.padded(self.observed_by_common(common, by_error) / self.sigma[..., None])
        more = len(self.extra_names)
        return np.concatenate([rows, np.zeros((len(self.runs), more, len(common)))], axis=1)

    @property
    def conditions(self) -> dict[str, str]:
        """Every condition of this problem with what it fixes, the known error last."""
        meanings = all_conditions(self.plane, self.nodes, self.first_angle)
        motions = dict(zip(WORKPIECE_CONDITIONS, ("shift along u", "shift along v", "turn"), strict=True))
        conditions = {name: meanings.get(name, "chosen by the campaign") for name in self.held}
        conditions |= {name: f"the shape as a whole has no {motions[name]}" for name in self.on_shape}
        return conditions | {self.length.parameter: meanings.get(self.length.parameter, "the unit of length")}
