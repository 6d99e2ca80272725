"""Steps of an error of a linear axis at searched places: a joint of a scale, a damaged spot of it, a joint of rails.

Hats a twelfth of the travel apart make a step of a mixture, as do pitches of a cycle or a sawtooth, and errors of other
axes mimic what such a mixture leaves. A step has one coefficient; the search of its place, and of the width over which
it goes, is paid for. What else a scale or its drive does, a play or a bend, is sought with it: beside one without the
other nothing of the catalogue comes near. Between two neighbouring positions every place is the same: their middle is
told.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from math import comb
from types import UnionType

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.scene_columns import columns_of
from monitor.discovery.machine.shapes.bends import foretells_poses
from monitor.discovery.machine.shapes.free_parts import PRICE, parts_worth_keeping, priced
from monitor.discovery.machine.shapes.refine import LIMIT
from monitor.discovery.machine.shapes.shown_cycles import is_told
from monitor.discovery.machine.shapes.tables import SAME_POSITION
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.projection import orthonormal, without
from monitor.effects import ChainEffect
from monitor.effects.drivers import Always
from monitor.effects.effect import ChainBasis
from monitor.effects.shape import Shape
from monitor.effects.shapes import Step
from monitor.effects.shapes.poly import Poly
from monitor.effects.shapes.reversal import Reversal
from monitor.effects.shapes.step import steps_at
from monitor.effects.shapes.windup import WindUp
from monitor.records import Array

# A region between two joints has two; more are a curve, which free shapes and tables have.
MOST_STEPS = 3
# One position beyond a step, or between two, would be a step as well as a point by itself.
POSITIONS_BEYOND = 2
# A region narrower than this part of the travel is one place of a part that is laid anew in every run.
LEAST_REGION = 1 / 96
# Places are looked for among so many, and about the best of them among all; steps that go over a width have places
# between positions as well: so many about the best.
PLACES, NEAR_PLACES = 36, 33
# Widths of the way from one level to the other that are tried, as parts of the travel, and about the best of them; what
# is wider than a twelfth is a curve, which hats follow.
WIDTHS = (1 / 96, 1 / 48, 1 / 24, 1 / 12)
NEAR_WIDTHS = (0.71, 0.84, 1.0, 1.19, 1.41)
# Longer ways are tried in place of each step, as parts of the shortest that is no step: three gaps between positions.
LONGER_WAYS = (1.0, 1.41, 2.0, 2.83, 4.0)
# Steps up and down that lie nearer than so many of their widths are a bump, which free shapes follow.
WIDTHS_APART = 4.0
# Powers of the position that are tried together beside steps; at fewer positions than a free shape has hats the two
# together follow any curve.
BENDS: tuple[tuple[str, ...], ...] = ((), ("poly2",), ("poly2", "poly3"))
POSITIONS_OF_BENDS = 12
# The square of a difference that is smaller, as part of the squares of the two, is rounding.
ROUNDED = 1e-11
# So many numbers of columns are remembered of an error, 32 MB.
MOST_NUMBERS = 4_000_000


@dataclass(frozen=True)
class StepsOfError:
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

    def _columns(self, places: Sequence[float], width: float) -> Array:
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
    def _widths(self) -> list[float]:
        """The widths in mm that are tried; a way between two positions is a step at once."""
        travel = float(self.positions[-1, 1] - self.positions[0, 0])
        usual = float(np.median(np.diff(self.positions.mean(axis=1))))
        widths = [float(f"{travel * part:.3g}") for part in WIDTHS if travel * part > usual]
        return [0.0, *(width for width in widths if np.diff(self._ends(width)) > 0.0)]

    def _ends(self, width: float) -> tuple[float, float]:
        """The first and the last place in mm of steps over a width: at the level beyond either stand positions enough,
        as beyond a step at once."""
        at, half = self.positions.mean(axis=1), width / 2.0
        return float(at[POSITIONS_BEYOND - 1]) + half, float(at[-POSITIONS_BEYOND]) - half

    def _places(self, width: float) -> Array:
        """The places among which steps of a width are looked for first."""
        if width:
            return np.linspace(*self._ends(width), PLACES)
        count = len(self.middles)
        return np.asarray(
            self.middles[np.unique(np.linspace(0, count - 1, min(count, PLACES)).astype(np.int64))]
        )

    def _near(self, at_mm: float, width: float) -> Array:
        """The places between the neighbours of one among the first."""
        first = self._places(width)
        if width:
            near = at_mm + np.linspace(-1.0, 1.0, NEAR_PLACES) * (first[1] - first[0])
            return np.asarray(np.round(near[(near >= first[0]) & (near <= first[-1])], 2))
        low, high = first[first < at_mm].max(initial=-np.inf), first[first > at_mm].min(initial=np.inf)
        return np.asarray(self.middles[(self.middles > low) & (self.middles < high)])

    @cached_property
    def _wholes(self) -> list[tuple[Array, float, ChainCandidate]]:
        """All steps of the first search together: places, width and effect."""
        return [
            (places, width, self._candidate(places, width))
            for places, width in ((self._places(width), width) for width in self._widths)
        ]

    def _candidate(self, places: Array | Sequence[float], width: float) -> ChainCandidate:
        """The steps at places in rising order as one effect."""
        shape = Step(tuple(map(float, places)), width)
        effect = replace(self.effect, shape=shape, shape_text=shape.text)
        # Between two positions all places are one.
        tries = comb(len(self.gaps), min(len(places), MOST_STEPS)) * len(self._widths)
        variant = Variant(f"{self.effect.term.symbol}:step", effect, max(tries, 1))
        return scene_of(self.scene.fit, [variant]).candidates[0]

    def _least_region(self, width: float) -> float:
        """How far apart in mm steps over a width have to be."""
        travel = float(self.positions[-1, 1] - self.positions[0, 0])
        return max(WIDTHS_APART * width, LEAST_REGION * travel)

    @cached_property
    def _middles_of_positions(self) -> Array:
        return np.asarray(self.positions.mean(axis=1))

    def _are_apart(self, places: Array | Sequence[float], width: float) -> npt.NDArray[np.bool_]:
        """Whether there are positions enough between neighbouring steps at places (..., k), at which both have come to
        their levels."""
        ordered = np.sort(places, axis=-1)
        between = np.diff(np.searchsorted(self._middles_of_positions, ordered), axis=-1)
        apart = (between >= POSITIONS_BEYOND) & (np.diff(ordered, axis=-1) >= self._least_region(width))
        return np.asarray(np.all(apart, axis=-1))

    def _are_inside(self, places: Sequence[float], width: float) -> bool:
        """Whether there are positions enough beyond the first and the last of some steps."""
        first, last = self._ends(width)
        return first <= min(places) and max(places) <= last

    def _of_shape(self, kind: type[Shape] | UnionType) -> list[ChainCandidate]:
        """The candidates of this error of some kinds of shape that follow no driver and are seen."""
        return [
            each
            for each in self.scene.candidates
            if isinstance(effect := each.effect, ChainEffect)
            and effect.term == self.effect.term
            and isinstance(effect.driver, Always)
            and isinstance(effect.shape, kind)
            and each.visible
        ]

    def _companions(self, others: Sequence[ChainCandidate]) -> list[list[ChainCandidate]]:
        """What may stand beside steps of the error: nothing, a play that says something beside others whatever its
        curve, at once or over a width, and with each a square, or a square and a cube."""
        curve = self._wholes[0][2]
        plays = weigh_beside(self.scene, self._of_shape(Reversal | WindUp), [*others, curve])
        with_play = [[plays[0].candidate]] if plays and plays[0].score > 0.0 else []
        powers = {each.family.partition(":")[2]: each for each in self._of_shape(Poly)}
        able = BENDS if len(self.positions) >= POSITIONS_OF_BENDS else BENDS[:1]
        bends = [[powers[name] for name in names] for names in able if powers.keys() >= {*names}]
        return [[*play, *bend] for play, bend in product([[], *with_play], bends)]

    def beside(self, others: Sequence[ChainCandidate]) -> list[ChainCandidate]:
        """The error as the steps that say most beside others, one effect of up to three, and a play or powers of it
        beside them where that says more; none where it is among them in another shape than a cycle, where none is
        worth its price, or where they foretell no poses."""
        if is_told(self.effect.term.symbol, others) or not len(self.gaps):
            return []
        choices = [
            [*steps, *companions]
            for companions in self._companions(others)
            if (steps := self._steps([*others, *companions]))
            and self._are_sharp(steps[0], companions, others)
        ]
        # Each of several effects was chosen, as the parts of a free shape are.
        best = max(
            choices, key=lambda some: priced(self.scene, some, others) - 2.0 * PRICE * len(some), default=[]
        )
        return best if best and foretells_poses(self.scene, best, others) else []

    def _steps(self, others: Sequence[ChainCandidate]) -> list[ChainCandidate]:
        """The steps that say most beside others, as one effect; none where none is worth its price."""
        worth, best = self._price(0, others) + self._cost([], 0.0, others), None
        for (places, width, whole), most in product(self._wholes, (1, MOST_STEPS)):
            selected = self._refined(self._selected(places, whole, most, others), width, others)
            selected = self._worth_keeping(selected, width, others)
            if not selected or not self._are_apart(selected, width):
                continue
            # The width of a way is one more unknown.
            price = self._price(len(selected) + bool(width), others)
            cost = price + self._cost(selected, width, others)
            if cost < worth:
                worth, best = cost, (selected, width)
        return [] if best is None else self._at_best_width(*best, others)

    def _at_best_width(
        self, places: Sequence[float], width: float, others: Sequence[ChainCandidate]
    ) -> list[ChainCandidate]:
        """The steps at the best width about one that was tried; none where the data do not see them."""
        widths = [float(f"{width * part:.3g}") for part in NEAR_WIDTHS] if width else []
        able = [some for some in widths if self._are_apart(places, some) and self._are_inside(places, some)]
        if able:
            width = min(able, key=lambda some: self._cost(places, some, others))
            places = self._worth_keeping(self._refined(places, width, others), width, others)
        steps = self._candidate(places, width)
        return [steps] if steps.visible else []

    def _are_sharp(
        self, steps: ChainCandidate, companions: Sequence[ChainCandidate], others: Sequence[ChainCandidate]
    ) -> bool:
        """Whether no longer way in place of any of the steps, beside companions, is likelier: of one step alone beyond
        doubt. Several places, a width and companions together follow any smooth curve about as well as a free shape
        does: of them a longer way has to be less likely, at a price for all of them but the first."""
        effect = steps.effect
        assert isinstance(effect, ChainEffect)
        assert isinstance(effect.shape, Step)
        count = len(effect.shape.readings) + (effect.shape.width > 0.0) + len(companions)
        least = (count - 1) * LIMIT if count > 1 else -LIMIT
        return self.sharpness(steps, [*others, *companions]) > least

    def sharpness(self, steps: ChainCandidate, others: Sequence[ChainCandidate]) -> float:
        """By how much, in twice the logarithm of a likelihood ratio, steps say more beside others than with a longer
        way in place of the least sharp of them."""
        effect = steps.effect
        assert isinstance(effect, ChainEffect)
        assert isinstance(effect.shape, Step)
        shape, freedom = effect.shape, self.scene.remainders.beside(others).degrees_of_freedom
        longer = [
            float(self.left_with([at_mm], rest, shape.width, others, way)[0])
            for index, at_mm in enumerate(shape.readings)
            for rest in [[*shape.readings[:index], *shape.readings[index + 1 :]]]
            for way in self._longer_ways(at_mm, shape.width)
        ]
        return freedom * float(np.log(min(longer))) - self._cost(shape.readings, shape.width, others)

    def _longer_ways(self, at_mm: float, width: float) -> list[float]:
        """Ways in mm about a place that take at least two positions on either side off the levels of a step there."""
        at = self.positions.mean(axis=1)
        after = int(np.clip(np.searchsorted(at, at_mm), 1, len(at) - 1))
        gap = at[after] - at[after - 1]
        around = at[min(after + 1, len(at) - 1)] - at[max(after - 2, 0)]
        return [max(3.0 * gap, around, 2.0 * width) * part for part in LONGER_WAYS]

    def _choice(self) -> float:
        """The logarithm of the number of places and widths."""
        return float(np.log(len(self.gaps) * len(self._widths)))

    def _price(self, count: int, others: Sequence[ChainCandidate]) -> float:
        """What so many steps and their choice take from the score."""
        freedom = self.scene.remainders.beside(others).degrees_of_freedom
        return count * (float(np.log(freedom)) + 2.0 * self._choice())

    def _cost(self, places: Sequence[float], width: float, others: Sequence[ChainCandidate]) -> float:
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
        basis = orthonormal(without(remainder.basis, self._columns(places, width)))
        return basis, without(basis, remainder.residual[:, None])[:, 0]

    def _selected(
        self, places: Array, whole: ChainCandidate, most: int, others: Sequence[ChainCandidate]
    ) -> list[float]:
        """The places of the first search that are worth their price, so many at most."""
        parts = parts_worth_keeping(self.scene, whole, others, most=most, choice=self._choice())
        return list(map(float, places[sorted(parts)]))

    def _refined(
        self, places: Sequence[float], width: float, others: Sequence[ChainCandidate]
    ) -> list[float]:
        """The places, each at the best between its neighbours of the first search."""
        best = list(places)
        for index, at_mm in enumerate(places):
            rest = best[:index] + best[index + 1 :]
            near = self._near(at_mm, width)
            near = near[
                self._are_apart(np.column_stack([np.tile(rest, (len(near), 1)), near]), width)
            ].tolist()
            if len(near) > 1:
                remaining = self.left_with(near, rest, width, others)
                # The middle of those that say the same: between two positions the readings are.
                alike = np.flatnonzero(remaining <= remaining.min() * (1.0 + 1e-9))
                best[index] = near[int(alike[len(alike) // 2])]
        return best

    def _worth_keeping(
        self, places: Sequence[float], width: float, others: Sequence[ChainCandidate]
    ) -> list[float]:
        """The places of steps that are worth their price beside the rest, now that all are where they say most."""
        worthy = list(places)
        while len(worthy) > 1:
            with_all = self._cost(worthy, width, others)
            without_each = [
                self._cost(worthy[:index] + worthy[index + 1 :], width, others)
                for index in range(len(worthy))
            ]
            least = int(np.argmin(without_each))
            if without_each[least] - with_all >= self._price(1, others):
                break
            del worthy[least]
        return worthy

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
            self.scene.remainders.beside(others).basis, self._columns(near, width if way is None else way)
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


def steps_of(scene: ChainScene, shape: ChainCandidate) -> StepsOfError | None:
    """The steps of the error of which a candidate is a shape; None where it turns or is none of an axis."""
    effect = shape.effect
    if not isinstance(effect, ChainEffect) or effect.joint.turns:
        return None
    return StepsOfError(scene, effect)
