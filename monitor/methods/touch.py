"""Touching targets: runs in which a stylus tip is brought to balls.

A run's own unknowns are the balls' coordinates and the stylus tip; a calibrated distance between two balls gives the
unit of length.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from monitor.machine import Evaluation
from monitor.methods.problem import ChainProblem
from monitor.records import Array


@dataclass(frozen=True)
class Distance:
    """A calibrated distance between two targets: length and standard uncertainty (R,) in mm, one a run."""

    between: tuple[str, str]
    length: Array
    standard_uncertainty: float


@dataclass(frozen=True)
class TouchProblem(ChainProblem):
    """Probings of balls. ``tip`` (3,) mm is the start for the stylus tip; every coordinate of a vector is told."""

    distances: tuple[Distance, ...] = ()
    tip: tuple[float, float, float] = (0.0, 0.0, 0.0)

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
    def movable(self) -> tuple[str, ...]:
        """The balls."""
        return self.targets

    @property
    def measured_joints(self) -> tuple[int, ...]:
        """The linear axes: their readings say where the tip met the ball."""
        return tuple(place for place, joint in enumerate(self.context.chain.joints) if not joint.turns)

    def foreseen(self) -> TouchProblem:
        """As read: balls at many poses move every axis by millimetres from touch to touch.

        Effects that a plan cannot see are blind exactly there, as the chain stands at the readings; at expected places
        1 µm of noise over 0.1 m leaves 1e-5 of their columns, which looks like something seen.
        """
        return self

    @property
    def extra_names(self) -> tuple[str, ...]:
        """The calibrated distances."""
        return tuple("-".join(distance.between) for distance in self.distances)

    def ends(self, own: Array) -> tuple[Array, Array]:
        """The ball of every probing and the tip."""
        balls = own[:, :-3].reshape(len(self.runs), len(self.targets), 3)
        return balls[self._run, self._target], own[self._run, -3:]

    def by_own(self, own: Array, seen: Evaluation) -> Array:
        """Derivatives (n, 3, q) by balls and tip."""
        found = np.zeros((len(self.context), 3, own.shape[1]))
        for axis in range(3):
            found[np.arange(len(self.context)), axis, 3 * self._target + axis] = -1.0
        found[:, :, -3:] = seen.by_tip
        return found

    def extras(self, own: Array) -> tuple[Array, Array]:
        """Length of every calibrated distance less the calibrated one."""
        balls = own[:, :-3].reshape(len(self.runs), len(self.targets), 3)
        residual = np.zeros((len(self.runs), len(self.distances)))
        by_own = np.zeros((len(self.runs), len(self.distances), own.shape[1]))
        for place, distance in enumerate(self.distances):
            first, second = (self.targets.index(name) for name in distance.between)
            between = balls[:, first] - balls[:, second]
            length = np.linalg.norm(between, axis=-1)
            residual[:, place] = (length - distance.length) / distance.standard_uncertainty
            slope = between / length[:, None] / distance.standard_uncertainty
            by_own[:, place, 3 * first : 3 * first + 3] = slope
            by_own[:, place, 3 * second : 3 * second + 3] = -slope
        return residual, by_own
