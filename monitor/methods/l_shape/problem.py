"""L-shape: the 21 geometric errors of a three-axis machine from an angle sensor that scans an L-shaped standard piece.

The piece carries modules along two arms, each with a plane face and a paraboloid of rotation. An autocollimating
sensor on the tool side sees two spots on its detector at every module: from the plane the two tilts of the sensor,
from the paraboloid these and the two displacements. The piece lies in the XY, the XZ and the YZ plane in turn, so
that every axis shows its two transverse angles, its positioning and its straightness, twice over where two planes
share an axis. Here all placements of a run are fitted at once on the chain; ``l_shape_stepwise`` follows the paper.

Source: X. Li et al., Rapid measurement and identification method for the geometric errors of CNC machine tools,
Appl. Sci. 9 (2019) 2701. Departures: Eq. (10) takes the sign that Eqs. (8) and (9) require (tilt = -S/2f), and Eq.
(18) accordingly; Eqs. (5) and (32) are those of the expanded Eq. (1), which the chain has by itself. Neglected:
tangent for angle, 1e-7 of a tilt of 0.5 mrad; products of errors, as in Eqs. (4) to (6).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.effects import ParsedEffect, parse_effect
from monitor.machine import ChainPose, evaluate
from monitor.methods.chain.least_squares import Linearisation
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array, LShape

# A placement leaves open where the piece lies in its plane (two lengths, one angle) and how sensor and piece are
# tilted against each other.
SETUP = ("shift u", "shift v", "turn", "tilt u", "tilt v")
_CALIBRATION = ("place u", "place v", "tilt u", "tilt v")


@dataclass(frozen=True)
class LShapeProblem(ChainProblem):
    """Spots on the detector as a least-squares problem; the four numbers of a row are lengths on the detector in mm.

    ``spots`` (n, 4) mm as measured, ``placement`` (n,) which placement of ``piece``. The modules' calibrated places and
    tilts are known to their stated uncertainty, and are unknowns of every run with that much freedom.
    """

    spots: Array
    placement: npt.NDArray[np.int64]
    piece: LShape
    tip: tuple[float, float, float]

    @cached_property
    def module(self) -> npt.NDArray[np.int64]:
        """Place of every row's module in the piece (n,)."""
        indices = {module.id: index for index, module in enumerate(self.piece.modules)}
        return np.array([indices[str(target)] for target in self.context.target])

    @cached_property
    def _frames(self) -> Array:
        """Unit vectors (P, 3, 3) u, v, w of every placement: along the arms, and out of the faces."""
        arms = np.array(
            [
                [np.eye(3)["XYZ".index(axis)] for axis in placement.plane]
                for placement in self.piece.placements
            ]
        )
        return np.stack([arms[:, 0], arms[:, 1], np.cross(arms[:, 0], arms[:, 1])], axis=1)

    @cached_property
    def frames(self) -> Array:
        """Unit vectors (n, 3, 3) u, v, w of every row."""
        return np.asarray(self._frames[self.placement])

    @cached_property
    def _used(self) -> tuple[int, ...]:
        """Places of the placements that were measured."""
        return tuple(int(index) for index in np.unique(self.placement))

    @cached_property
    def calibrated(self) -> tuple[int, ...]:
        """Places of the modules whose calibration matters: all that were scanned but the reference."""
        return tuple(int(index) for index in np.unique(self.module) if index != self.piece.reference)

    @cached_property
    def own_names(self) -> tuple[str, ...]:
        setup = [f"{self.piece.placements[index].plane} {motion}" for index in self._used for motion in SETUP]
        modules = [self.piece.modules[index].id for index in self.calibrated]
        return (*setup, *(f"module {module} {part}" for module in modules for part in _CALIBRATION))

    def all_orders(self) -> tuple[ParsedEffect, ...]:
        """The base effects and the first orders of the straightness, which the stepwise way has besides."""
        chain = self.context.chain
        texts = [
            f"E{component}{joint.name}:poly1"
            for joint in chain.joints
            for component in "XYZ"
            if joint.direction["XYZ".index(component)] != 1.0
        ]
        base = tuple(effect for effect in self.base if isinstance(effect, ParsedEffect))
        return (*base, *(parse_effect(text, chain) for text in texts))

    @cached_property
    def own_start(self) -> Array:
        return np.zeros((len(self.runs), len(self.own_names)))

    @property
    def components(self) -> tuple[str, ...]:
        return ("plane u", "plane v", "paraboloid u", "paraboloid v")

    @property
    def extra_names(self) -> tuple[str, ...]:
        return tuple(name for name in self.own_names if name.startswith("module "))

    @property
    def standard_lengths(self) -> Array:
        """Places of the modules from the reference, in their standard uncertainties; tilts do not change."""
        centres = np.array([self.piece.modules[index].centre for index in self.calibrated])
        strained = np.zeros((len(self.calibrated), len(_CALIBRATION)))
        strained[:, :2] = centres - np.array(self.piece.modules[self.piece.reference].centre)
        return strained.ravel() / self.piece.place_uncertainty

    def _parts(self, nuisance: Array) -> tuple[Array, Array]:
        """Setup (n, 5) of every row's placement and deviations (n, 4) of its module, in mm and rad."""
        count = len(SETUP) * len(self._used)
        setup = nuisance[:, :count].reshape(len(nuisance), len(self._used), len(SETUP))
        which = np.searchsorted(np.array(self._used), self.placement)
        modules = np.zeros((len(nuisance), len(self.piece.modules), 4))
        modules[:, list(self.calibrated)] = nuisance[:, count:].reshape(
            len(nuisance), len(self.calibrated), 4
        )
        return setup[self._run, which], modules[self._run, self.module]

    @cached_property
    def in_plane(self) -> Array:
        """Calibrated places (n, 2) mm of the modules in the piece's plane, less the reference's."""
        centres = np.array([module.centre for module in self.piece.modules])
        places: Array = (centres - centres[self.piece.reference])[self.module]
        return places

    def ends(self, nuisance: Array) -> tuple[Array, Array]:
        """The middle of the module's paraboloid and the sensor's reference point."""
        setup, deviation = self._parts(nuisance)
        flat = self.in_plane + deviation[:, :2]
        cos, sin = np.cos(setup[:, 2]), np.sin(setup[:, 2])
        turned = np.column_stack([cos * flat[:, 0] - sin * flat[:, 1], sin * flat[:, 0] + cos * flat[:, 1]])
        corners = np.array([placement.corner for placement in self.piece.placements])[
            self.placement
        ] + np.array(self.tip)
        target = corners + np.einsum("nk,nki->ni", turned + setup[:, :2], self.frames[:, :2])
        return target, np.tile(np.array(self.tip), (len(target), 1))

    def evaluated(self, local: Array, common: Array, *, jacobian: bool = False) -> ChainPose:
        """Residuals (n, 6): displacement in mm from the module to the sensor, then how much further a point 1 mm
        along the faces' normal is displaced, in mm/mm, both less what the spots measure."""
        errors, target, tip = self.state(local, common)
        chain, positions = self.context.chain, self.context.positions
        normal, arms = self.frames[:, 2], self.frames[:, :2]
        first = evaluate(chain, positions, errors, target, tip, jacobian=jacobian)
        setup, deviation = self._parts(self.own_of(local))
        module = np.array([module.tilt for module in self.piece.modules])[self.module]
        tilts = -self.spots[:, :2] / (2.0 * self.piece.focal_length)
        lengths = -self.piece.paraboloid * (self.spots[:, 2:] / (2.0 * self.piece.focal_length) + tilts)
        turned = np.einsum("nij,nj->ni", first.by_tip, normal) - normal
        stated = tilts + setup[:, 3:] + deviation[:, 2:] + module
        residual = np.concatenate(
            [
                first.residual - np.einsum("nk,nki->ni", lengths, arms),
                turned - np.einsum("nk,nki->ni", stated, arms),
            ],
            axis=1,
        )
        by_error = None
        if first.by_error is not None:
            second = evaluate(chain, positions, errors, target + normal, tip + normal, jacobian=True)
            assert second.by_error is not None
            by_error = np.concatenate([first.by_error, second.by_error - first.by_error], axis=1)
        return ChainPose(residual, first.by_tip, first.work_rotation, by_error)

    def by_own(self, nuisance: Array, pose: ChainPose) -> Array:
        """Derivatives (n, 6, q) by setup and modules."""
        derivatives = np.zeros((len(self.context), 6, nuisance.shape[1]))
        setup, deviation = self._parts(nuisance)
        u, v = self.frames[:, 0], self.frames[:, 1]
        flat = self.in_plane + deviation[:, :2]
        cos, sin = np.cos(setup[:, 2, None]), np.sin(setup[:, 2, None])
        along, across = cos * u + sin * v, cos * v - sin * u
        rows = np.arange(len(derivatives))
        first = len(SETUP) * np.searchsorted(np.array(self._used), self.placement)
        derivatives[rows, :3, first] = -u
        derivatives[rows, :3, first + 1] = -v
        derivatives[rows, :3, first + 2] = -(flat[:, :1] * across - flat[:, 1:] * along)
        derivatives[rows, 3:, first + 3] = -u
        derivatives[rows, 3:, first + 4] = -v
        start = len(SETUP) * len(self._used)
        for index, module in enumerate(self.calibrated):
            module_rows = np.flatnonzero(self.module == module)
            column = start + 4 * index
            derivatives[module_rows, :3, column] = -along[module_rows]
            derivatives[module_rows, :3, column + 1] = -across[module_rows]
            derivatives[module_rows, 3:, column + 2] = -u[module_rows]
            derivatives[module_rows, 3:, column + 3] = -v[module_rows]
        return derivatives

    @cached_property
    def _perfect(self) -> ChainPose:
        """A machine without errors and a piece laid down exactly: its spots, and the derivatives."""
        return self.evaluated(self.start, np.zeros(len(self.added_names)), jacobian=True)

    @cached_property
    def _rows(self) -> Array:
        """Derivatives (n, 4, p) of a row by the unknowns of its run."""
        pose = self._perfect
        assert pose.by_error is not None
        parts = [effect.basis(self.context).displacement(pose.by_error) for effect in self.base]
        return self.observe(np.concatenate([*parts, self.by_own(self.own_start, pose)], axis=-1))

    def vectors(self, local: Array, common: Array) -> Array:
        """Residuals (n, 4) in mm on the detector, to first order in all errors, as Eqs. (4) to (6) have them."""
        perfect = self._perfect
        assert perfect.by_error is not None
        vectors: Array = self.observe(perfect.residual)
        vectors = vectors + np.einsum("nip,np->ni", self._rows, local[self._run])
        for moved in self.observed_displacements(common, perfect.by_error):
            vectors += moved
        return vectors

    def linearise(self, local: Array, common: Array) -> Linearisation:
        """Whitened residuals and derivatives.

        To first order, as the source has it: what the placements cannot separate is then exactly so, where products
        of errors (3e-4 of a derivative) would seem to separate it. Neglected: a tenth of a micrometre for a piece of
        200 mm that lies 1 mrad askew, 4 nm at 0.2 mrad.
        """
        by_error = self._perfect.by_error
        assert by_error is not None
        extra, by_extra = self.extras(self.own_of(local))
        before = ((0, 0), (0, 0), (len(self.base_names), 0))
        sigma = self.sigma[..., None]
        return Linearisation(
            np.concatenate([self.padded(self.vectors(local, common) / self.sigma), extra], axis=1),
            np.concatenate([self.padded(self._rows / sigma), np.pad(by_extra, before)], axis=1),
            np.concatenate(
                [
                    self.padded(self.observed_by_common(common, by_error) / sigma),
                    np.zeros((*extra.shape, len(common))),
                ],
                axis=1,
            ),
        )

    def observe(self, rows: Array) -> Array:
        """Spots (n, 4, ...) on the detector of displacements and tilts (n, 6, ...); a shift alone (n, 3, ...) tilts
        nothing."""
        moved = np.einsum("nki,ni...->nk...", self.frames[:, :2], rows[:, :3])
        tilted = np.zeros_like(moved)
        if rows.shape[1] == 6:
            tilted = np.einsum("nki,ni...->nk...", self.frames[:, :2], rows[:, 3:])
        twice = -2.0 * self.piece.focal_length
        return np.concatenate([twice * tilted, twice * (moved / self.piece.paraboloid + tilted)], axis=1)

    def for_search(self) -> LShapeProblem:
        """The modules deviate from their calibration alike in all R runs. Each run has a deviation of its own here,
        so its uncertainty is widened by the root of R: all runs together then determine it no better than one does."""
        wider = float(np.sqrt(len(self.runs)))
        piece = replace(
            self.piece,
            place_uncertainty=self.piece.place_uncertainty * wider,
            tilt_uncertainty=self.piece.tilt_uncertainty * wider,
        )
        return replace(self.foreseen(), piece=piece)

    def extras(self, nuisance: Array) -> tuple[Array, Array]:
        """The modules' deviations from their calibration, in standard uncertainties of it."""
        first = len(SETUP) * len(self._used)
        piece = self.piece
        u = np.tile([piece.place_uncertainty] * 2 + [piece.tilt_uncertainty] * 2, len(self.calibrated))
        by_own = np.zeros((len(nuisance), len(u), nuisance.shape[1]))
        by_own[:, np.arange(len(u)), first + np.arange(len(u))] = 1.0 / u
        return nuisance[:, first:] / u, by_own
