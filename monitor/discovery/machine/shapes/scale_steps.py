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
from types import UnionType

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.shapes.bends import foretells_poses
from monitor.discovery.machine.shapes.free_parts import PRICE, parts_worth_keeping, priced
from monitor.discovery.machine.shapes.shown_cycles import is_told
from monitor.discovery.machine.shapes.step_widths import OneStep, are_sharp, at_widths_of_their_own, by_width
from monitor.discovery.machine.shapes.steps_seen import MOST_STEPS, NEAR_WIDTHS, StepsSeen
from monitor.discovery.search.candidate import side_by_side
from monitor.discovery.search.evidence import weigh_beside
from monitor.effects import ChainEffect
from monitor.effects.drivers import Always
from monitor.effects.shape import Shape
from monitor.effects.shapes.poly import Poly
from monitor.effects.shapes.reversal import Reversal
from monitor.effects.shapes.windup import WindUp
from monitor.records import Array

# Places are looked for among so many, and about the best of them among all; steps that go over a width have places
# between positions as well: so many about the best.
PLACES, NEAR_PLACES = 36, 33
# Powers of the position that are tried together beside steps; at fewer positions than a free shape has hats the two
# together follow any curve.
BENDS: tuple[tuple[str, ...], ...] = ((), ("poly2",), ("poly2", "poly3"))
POSITIONS_OF_BENDS = 12


@dataclass(frozen=True)
class StepsOfError(StepsSeen):
    """The steps of an error of a linear axis that are worth their price, and what stands beside them."""

    def _places(self, width: float) -> Array:
        """The places among which steps of a width are looked for first."""
        if width:
            return np.linspace(*self.ends(width), PLACES)
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
            (places, width, self.candidate(places, width))
            for places, width in ((self._places(width), width) for width in self.widths)
        ]

    @cached_property
    def _together(self) -> ChainCandidate:
        """The steps at once of the first search with the plays and the powers of the error, as columns of one."""
        whole = self._wholes[0][2]
        beside = self._of_shape(Reversal | WindUp | Poly)
        return replace(whole, columns=side_by_side(len(whole.columns), [whole, *beside]))

    def rough(self, others: Sequence[ChainCandidate]) -> ChainCandidate | None:
        """Those steps at once, plays and powers of the error that explain most beside others, more of them than
        `beside` tells, as one effect; None where it has no steps."""
        if not len(self.gaps):
            return None
        parts = parts_worth_keeping(self.scene, self._together, others, choice=0.0)
        return replace(self._together, columns=self._together.columns[:, parts])

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
        """The error as the steps that say most beside others, up to three, one effect for each width of them, and a
        play or powers of it beside them where that says more; none where it is among them in another shape than a
        cycle, where none is worth its price, or where they foretell no poses."""
        if is_told(self.effect.term.symbol, others) or not len(self.gaps):
            return []
        choices = [
            [*steps, *companions]
            for companions in self._companions(others)
            if (steps := self._steps([*others, *companions])) and are_sharp(self, steps, companions, others)
        ]
        # Each of several effects was chosen, as the parts of a free shape are.
        best = max(
            choices, key=lambda some: priced(self.scene, some, others) - 2.0 * PRICE * len(some), default=[]
        )
        return best if best and foretells_poses(self.scene, best, others) else []

    def _steps(self, others: Sequence[ChainCandidate]) -> list[ChainCandidate]:
        """The steps that say most beside others, as one effect for each width; none where none is worth its price."""
        worth, best = self.price(0, others) + self.cost([], 0.0, others), None
        for (places, width, whole), most in product(self._wholes, (1, MOST_STEPS)):
            selected = self._refined(self._selected(places, whole, most, others), width, others)
            selected = self._kept_apart(self._worth_keeping(selected, width, others), width, others)
            if not selected:
                continue
            # The width of a way is one more unknown.
            price = self.price(len(selected) + bool(width), others)
            cost = price + self.cost(selected, width, others)
            if cost < worth:
                worth, best = cost, (selected, width)
        return [] if best is None else self._at_best_width(*best, others)

    def _at_best_width(
        self, places: Sequence[float], width: float, others: Sequence[ChainCandidate]
    ) -> list[ChainCandidate]:
        """The steps at the best width about one that was tried; none where the data do not see them."""
        widths = [float(f"{width * part:.3g}") for part in NEAR_WIDTHS] if width else []
        able = [some for some in widths if self.are_apart(places, some) and self.are_inside(places, some)]
        if able:
            width = min(able, key=lambda some: self.cost(places, some, others))
            places = self._worth_keeping(self._refined(places, width, others), width, others)
        of_one_width = [OneStep(at_mm, width) for at_mm in places]
        steps = by_width(self, at_widths_of_their_own(self, of_one_width, others))
        return steps if all(each.visible for each in steps) else []

    def _selected(
        self, places: Array, whole: ChainCandidate, most: int, others: Sequence[ChainCandidate]
    ) -> list[float]:
        """The places of the first search that are worth their price, so many at most."""
        parts = parts_worth_keeping(self.scene, whole, others, most=most, choice=self.choice())
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
                self.are_apart(np.column_stack([np.tile(rest, (len(near), 1)), near]), width)
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
            with_all = self.cost(worthy, width, others)
            without_each = [
                self.cost(worthy[:index] + worthy[index + 1 :], width, others) for index in range(len(worthy))
            ]
            least = int(np.argmin(without_each))
            if without_each[least] - with_all >= self.price(1, others):
                break
            del worthy[least]
        return worthy

    def _kept_apart(
        self, places: Sequence[float], width: float, others: Sequence[ChainCandidate]
    ) -> list[float]:
        """The places that are far enough apart, without those that say least: a way over more than a width was followed
        by two of its steps."""
        places_apart = list(places)
        while len(places_apart) > 1 and not self.are_apart(places_apart, width):
            without_each = [
                places_apart[:index] + places_apart[index + 1 :] for index in range(len(places_apart))
            ]
            places_apart = min(without_each, key=lambda some: self.cost(some, width, others))
        changed = len(places_apart) < len(places)
        return (
            self._worth_keeping(self._refined(places_apart, width, others), width, others)
            if changed
            else places_apart
        )


def steps_of(scene: ChainScene, shape: ChainCandidate) -> StepsOfError | None:
    """The steps of the error of which a candidate is a shape; None where it turns or is none of an axis."""
    effect = shape.effect
    if not isinstance(effect, ChainEffect) or effect.joint.turns:
        return None
    return StepsOfError(scene, effect)
