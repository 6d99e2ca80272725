"""Steps of an error of a linear axis as the data see them: where they may be, their columns, and what they leave.

Between two neighbouring positions every place is the same: their middle is told.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import comb

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.scene_columns import columns_of
from monitor.discovery.machine.shapes.tables import SAME_POSITION
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.projection import orthonormal, without
from monitor.effects import ChainEffect
from monitor.effects.effect import ChainBasis
from monitor.effects.shapes import Step
from monitor.effects.shapes.step import steps_at
from monitor.records import Array

# A region between two joints has two; more are a curve, which free shapes and tables have.
MOST_STEPS = 3
# One position beyond a step, or between two, would be a step as well as a point by itself.
POSITIONS_BEYOND = 2
# A region narrower than this part of the travel is one place of a part that is laid anew in every run.
LEAST_REGION = 1 / 96
# Widths of the way from one level to the other that are tried, as parts of the travel, and about the best of them; what
# is wider than a twelfth is a curve, which hats follow.
WIDTHS = (1 / 96, 1 / 48, 1 / 24, 1 / 12)
NEAR_WIDTHS = (0.71, 0.84, 1.0, 1.19, 1.41)
# Steps up and down that lie nearer than so many of their widths are a bump, which free shapes follow.
WIDTHS_APART = 4.0
# The square of a difference that is smaller, as part of the squares of the two, is rounding.
ROUNDED = 1e-11
# So many numbers of columns are remembered of an error, 32 MB.
MOST_NUMBERS = 4_000_000


@dataclass(frozen=True)
class StepsSeen:
    """The steps of an error of a linear axis, between the positions where it stood; ``effect`` is the error in any of
    its shapes."""

    scene: ChainScene
    effect: ChainEffect

    @cached_property
    def _reading(self) -> Array:
        """The readings (n,) of the axis in mm."""
        places = self.scene.fit.problem.context.places
        return np.asarray(self.effect.joint.sign * places[:, self.effect.term.joint])

    @cached_property
    def _made(self) -> dict[tuple[float, float], Array]:
        """The columns (M,) of steps by place and width, as the data see them, each made once."""
        return {}

    def columns(self, places: Sequence[float], width: float) -> Array:
        """The columns (M, k) of a step at each of some places."""
        if (len(self._made) + len(places)) * len(self.scene.residual) > MOST_NUMBERS:
            self._made.clear()
        new = [at_mm for at_mm in dict.fromkeys(places) if (at_mm, width) not in self._made]
        steps = steps_at(self._reading, new, width)
        columns_of_steps = columns_of(
            self.scene.fit, [ChainBasis(self.effect.term, step[:, None]) for step in steps.T]
        )
        self._made.update(
            {(at_mm, width): step.columns[0] for at_mm, step in zip(new, columns_of_steps, strict=True)}
        )
        return np.array([self._made[at_mm, width] for at_mm in places]).T

    @cached_property
    def readings(self) -> Array:
        """The readings (n,) of the axis in mm where they have weight, in rising order."""
        return np.sort(self._reading[self.scene.fit.has_weight.any(axis=1)])

    @cached_property
    def positions(self) -> Array:
        """The lowest and the highest reading (n, 2) in mm of each position at which the axis stood where readings have
        weight: one that is left out shows no level."""
        reading = self.readings
        apart = np.flatnonzero(np.diff(reading) > SAME_POSITION)
        first, last = np.concatenate([[0], apart + 1]), np.concatenate([apart, [len(reading) - 1]])
        return np.column_stack([reading[first], reading[last]])

    @cached_property
    def gaps(self) -> Array:
        """The lower and upper ends (g, 2) in mm of what lies between neighbouring positions, where a step may be."""
        between = np.column_stack([self.positions[:-1, 1], self.positions[1:, 0]])
        between = between[POSITIONS_BEYOND - 1 : len(between) - POSITIONS_BEYOND + 1]
        first, last = self.positions[0, 0], self.positions[-1, 1]
        wide = LEAST_REGION * (last - first)
        return np.asarray(between[(between[:, 1] > first + wide) & (between[:, 0] < last - wide)])

    @cached_property
    def middles(self) -> Array:
        """The middles (g,) of the gaps, in mm with two digits: gaps are wider than ``SAME_POSITION``."""
        return np.asarray(np.round(self.gaps.mean(axis=1), 2))

    @cached_property
    def widths(self) -> list[float]:
        """The widths in mm that are tried; a way between two positions is a step at once."""
        travel = float(self.positions[-1, 1] - self.positions[0, 0])
        usual = float(np.median(np.diff(self.positions.mean(axis=1))))
        widths = [float(f"{travel * part:.3g}") for part in WIDTHS if travel * part > usual]
        return [0.0, *(width for width in widths if np.diff(self.ends(width)) > 0.0)]

    def ends(self, width: float) -> tuple[float, float]:
        """The first and the last place in mm of steps over a width: at the level beyond either stand positions enough,
        as beyond a step at once."""
        at, half = self.positions.mean(axis=1), width / 2.0
        return float(at[POSITIONS_BEYOND - 1]) + half, float(at[-POSITIONS_BEYOND]) - half

    def candidate(self, places: Array | Sequence[float], width: float) -> ChainCandidate:
        """The steps at places in rising order as one effect."""
        shape = Step(tuple(map(float, places)), width)
        effect = replace(self.effect, shape=shape, shape_text=shape.text)
        # Between two positions all places are one.
        tries = comb(len(self.gaps), min(len(places), MOST_STEPS)) * len(self.widths)
        variant = Variant(f"{self.effect.term.symbol}:step", effect, max(tries, 1))
        return scene_of(self.scene.fit, [variant]).candidates[0]

    def least_region(self, width: float) -> float:
        """How far apart in mm steps over a width have to be."""
        travel = float(self.positions[-1, 1] - self.positions[0, 0])
        return max(WIDTHS_APART * width, LEAST_REGION * travel)

    @cached_property
    def middles_of_positions(self) -> Array:
        """The middles (n,) of the positions, in mm."""
        return np.asarray(self.positions.mean(axis=1))

    def are_apart(self, places: Array | Sequence[float], width: float) -> npt.NDArray[np.bool_]:
        """Whether there are positions enough between neighbouring steps at places (..., k), at which both have come to
        their levels."""
        ordered = np.sort(places, axis=-1)
        between = np.diff(np.searchsorted(self.middles_of_positions, ordered), axis=-1)
        apart = (between >= POSITIONS_BEYOND) & (np.diff(ordered, axis=-1) >= self.least_region(width))
        return np.asarray(np.all(apart, axis=-1))

    def are_inside(self, places: Sequence[float], width: float) -> bool:
        """Whether there are positions enough beyond the first and the last of some steps."""
        first, last = self.ends(width)
        return first <= min(places) and max(places) <= last

    def choice(self) -> float:
        """The logarithm of the number of places and widths."""
        return float(np.log(len(self.gaps) * len(self.widths)))

    def price(self, count: int, others: Sequence[ChainCandidate]) -> float:
        """What so many steps and their choice take from the score."""
        freedom = self.scene.remainders.beside(others).degrees_of_freedom
        return count * (float(np.log(freedom)) + 2.0 * self.choice())

    def cost(self, places: Sequence[float], width: float, others: Sequence[ChainCandidate]) -> float:
        """Minus twice the logarithm of the likelihood of steps at places beside others."""
        freedom = self.scene.remainders.beside(others).degrees_of_freedom
        _, residual = self._beside(places, width, others)
        return freedom * float(np.log(residual @ residual))

    def _beside(
        self, places: Sequence[float], width: float, others: Sequence[ChainCandidate]
    ) -> tuple[Array, Array]:
        """An orthonormal basis (M, r) of what steps at places add to others, and what both leave (M,) of the
        residual."""
        remainder = self.scene.remainders.beside(others)
        if not len(places):
            return remainder.basis[:, :0], remainder.residual
        basis = orthonormal(without(remainder.basis, self.columns(places, width)))
        return basis, without(basis, remainder.residual[:, None])[:, 0]

    def left_with(
        self,
        near: Sequence[float],
        rest: Sequence[float],
        width: float,
        others: Sequence[ChainCandidate],
        way: float | None = None,
    ) -> Array:
        """What is left (k,) of the residual with a step at each of some places, over another ``way`` if given, beside
        steps at ``rest`` and others."""
        basis, residual = self._beside(rest, width, others)
        columns = without(
            self.scene.remainders.beside(others).basis, self.columns(near, width if way is None else way)
        )
        columns = without(basis, columns)
        length = np.linalg.norm(columns, axis=0)
        onto = columns.T @ residual / np.where(length > 0.0, length, 1.0)
        return np.asarray(residual @ residual - onto**2)

    def left_with_ways(
        self,
        begins: Array,
        ends: Array,
        rest: Sequence[float],
        width: float,
        others: Sequence[ChainCandidate],
    ) -> Array:
        """What is left (b, e) of the residual with a step that begins and ends at each of some readings, beside steps
        over a width at ``rest`` and others; infinite where the end is not behind the beginning.

        An even way is the difference of two kinks, so that the data have to see the kinks alone.
        """
        basis, residual = self._beside(rest, width, others)
        kinks, where = np.unique(np.concatenate([begins, ends]), return_inverse=True)
        bent = np.abs(self._reading[:, None] - kinks) / 2.0
        columns_of_kinks = columns_of(
            self.scene.fit, [ChainBasis(self.effect.term, kink[:, None]) for kink in bent.T]
        )
        columns = without(
            self.scene.remainders.beside(others).basis,
            np.array([kink.columns[0] for kink in columns_of_kinks]).T,
        )
        columns = without(basis, columns)
        begin, end = where[: len(begins)], where[len(begins) :]
        products, onto = columns.T @ columns, columns.T @ residual
        squares = np.diag(products)
        squared = squares[begin][:, None] + squares[end] - 2.0 * products[np.ix_(begin, end)]
        # Less is rounding: the data do not see the way.
        least = ROUNDED * (squares[begin][:, None] + squares[end])
        is_way = (ends > begins[:, None]) & (squared > least)
        explained = (onto[begin][:, None] - onto[end]) ** 2 / np.where(is_way, squared, 1.0)
        return np.where(is_way, residual @ residual - explained, np.inf)
