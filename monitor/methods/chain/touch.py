"""Touching targets: runs in which a stylus tip is brought to balls.

A run's own unknowns are the balls' coordinates and the stylus tip; a calibrated distance between two balls gives the
unit of length.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.effects import ChainEffect
from monitor.machine import ChainPose
from monitor.methods.chain.measured import LARGEST_GAIN
from monitor.methods.chain.problem import ChainProblem, solve_problem, stops
from monitor.records import Array
from monitor.sources import CommonQuantity

# mm; more than the stylus' offset moves an axis as the spindle turns, less than any plan means to move it.
STILL = 1.0


@dataclass(frozen=True)
class Distance:
    """A calibrated distance between two targets: length (R,) and standard uncertainty in mm, one length a run; what it
    is ``of`` where that is known."""

    between: tuple[str, str]
    length: Array
    standard_uncertainty: float
    of: CommonQuantity | None = None


@dataclass(frozen=True)
class TouchProblem(ChainProblem):
    """Probings of balls. ``tip`` (3,) mm is the start for the stylus tip; every coordinate of a vector is measured.

    Where the chain stands at expected places, ``beside`` (n, 3) mm is what the readings differ by there, and ``read``
    (n, J) where the joints were read.
    """

    distances: tuple[Distance, ...] = ()
    tip: tuple[float, float, float] = (0.0, 0.0, 0.0)
    beside: Array | None = None
    read: Array | None = None

    @cached_property
    def own_names(self) -> tuple[str, ...]:
        """Coordinates of the balls, then of the tip."""
        balls = tuple(f"ball {target} {axis}" for target in self.targets for axis in "xyz")
        return (*balls, "tip x", "tip y", "tip z")

    @cached_property
    def own_start(self) -> Array:
        """Balls at their nominal places (R, q)."""
        first = {str(t): row for row, t in reversed(list(enumerate(self.context.target)))}
        nominal = np.concatenate([self.context.nominal[first[t]] for t in self.targets])
        return np.tile(np.concatenate([nominal, self.tip]), (len(self.runs), 1))

    @property
    def shared_by_rows(self) -> tuple[str, ...]:
        """Nothing more."""
        return ()

    @property
    def standard_lengths(self) -> Array:
        """The calibrated distances, in mm."""
        return np.array([distance.length[0] for distance in self.distances])

    @property
    def touches_centres(self) -> bool:
        """Always."""
        return True

    @property
    def movable(self) -> tuple[str, ...]:
        """The balls."""
        return self.targets

    @property
    def moved_together(self) -> Array:
        """Three shifts and three turns of all balls together, and the tip."""
        places = self.own_start[0][:-3].reshape(-1, 3)
        arms = places - places.mean(axis=0)
        turns = np.stack([np.cross(axis, arms).reshape(-1) for axis in np.eye(3)], axis=1)
        balls = np.concatenate([np.tile(np.eye(3), (len(places), 1)), turns], axis=1)
        moves = np.zeros((len(balls) + 3, 9))
        moves[:-3, :6], moves[-3:, 6:] = balls, np.eye(3)
        return moves

    @cached_property
    def stays_small(self) -> npt.NDArray[np.bool_]:
        """The gains: with one rotary axis balls and gains grow together, and a world of half the size has half the
        noise."""
        gains = [isinstance(effect, ChainEffect) and effect.is_gain for effect in self.base]
        sizes = [columns.stop - columns.start for columns in self.base_columns]
        return np.concatenate([np.repeat(gains, sizes), np.zeros(len(self.own_names), dtype=bool)])

    @property
    def largest_gain(self) -> float:
        """No scale is off by a hundredth; a bar of another length is soon."""
        return LARGEST_GAIN

    @property
    def measured_joints(self) -> tuple[int, ...]:
        """The linear axes: their readings are where the tip met the ball."""
        return tuple(index for index, joint in enumerate(self.context.chain.joints) if not joint.turns)

    def foreseen(self) -> TouchProblem:
        """As read, unless an axis stands still while a ball is probed at all its poses.

        Where balls move every axis by millimetres from touch to touch, the reading is as good as the expected place. An
        axis that stands still (along a single rotary axis) measures its noise, and leaves gains to what moves
        the others least: the chain is then taken where it is expected to stop, what the readings differ by beside it.
        """
        if self.context.expected is not None or not self._stands_still:
            return self
        bare = replace(self, added=())
        solution = solve_problem(bare)
        places = stops(bare, solution)
        return replace(
            self,
            context=replace(self.context.expecting(places), positions=places),
            beside=bare.evaluated(solution.local, solution.common).residual,
            read=self.context.positions,
        )

    def evaluated(self, local: Array, common: Array, *, jacobian: bool = False) -> ChainPose:
        """The chain where it stands, and what the readings differ by."""
        pose = super().evaluated(local, common, jacobian=jacobian)
        return pose if self.beside is None else replace(pose, residual=pose.residual + self.beside)

    @property
    def _stands_still(self) -> bool:
        """Whether there is a linear axis that every ball moves by less than ``STILL`` over all its probings."""
        order = np.argsort(self._target, kind="stable")
        first = np.searchsorted(self._target[order], np.arange(len(self.targets)))
        read = self.context.positions[order]
        moved = (np.maximum.reduceat(read, first) - np.minimum.reduceat(read, first)).max(axis=0)
        return any(moved[index] < STILL for index in self.measured_joints)

    @property
    def extra_names(self) -> tuple[str, ...]:
        """The calibrated distances."""
        return tuple("-".join(distance.between) for distance in self.distances)

    @property
    def common_quantities(self) -> tuple[CommonQuantity | None, ...]:
        """The calibrated distances."""
        return tuple(distance.of for distance in self.distances)

    def ends(self, nuisance: Array) -> tuple[Array, Array]:
        """The ball of every probing and the tip."""
        balls = nuisance[:, :-3].reshape(len(self.runs), len(self.targets), 3)
        return balls[self._run, self._target], nuisance[self._run, -3:]

    def by_own(self, nuisance: Array, pose: ChainPose) -> Array:
        """Derivatives (n, 3, q) by balls and tip."""
        derivatives = np.zeros((len(self.context), 3, nuisance.shape[1]))
        for axis in range(3):
            derivatives[np.arange(len(self.context)), axis, 3 * self._target + axis] = -1.0
        derivatives[:, :, -3:] = pose.by_tip
        return derivatives

    def extras(self, nuisance: Array) -> tuple[Array, Array]:
        """Length of every calibrated distance less the calibrated one."""
        balls = nuisance[:, :-3].reshape(len(self.runs), len(self.targets), 3)
        residual = np.zeros((len(self.runs), len(self.distances)))
        by_own = np.zeros((len(self.runs), len(self.distances), nuisance.shape[1]))
        for index, distance in enumerate(self.distances):
            first, second = (self.targets.index(name) for name in distance.between)
            between = balls[:, first] - balls[:, second]
            length = np.linalg.norm(between, axis=-1)
            residual[:, index] = (length - distance.length) / distance.standard_uncertainty
            slope = between / length[:, None] / distance.standard_uncertainty
            by_own[:, index, 3 * first : 3 * first + 3] = slope
            by_own[:, index, 3 * second : 3 * second + 3] = -slope
        return residual, by_own
