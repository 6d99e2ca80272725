"""The effects of a chain that the data do not rule out beside those that were found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from monitor.discovery.machine.scene import (
    ChainCandidate,
    ChainScene,
    ChainVariant,
    MachineEffect,
    scene_of,
)
from monitor.discovery.machine.separation.in_place_of_products import in_place_of_products
from monitor.discovery.machine.separation.late import is_at_once
from monitor.discovery.machine.separation.other_axes import free_of_other_axes
from monitor.discovery.machine.shapes.alias_orders import aliases_of_order
from monitor.discovery.machine.shapes.alias_pitches import aliases_of
from monitor.discovery.machine.shapes.axes_of_plate import axes_as_likely
from monitor.discovery.machine.shapes.drifts_of_runs import FEWEST_RUNS, in_one_run
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.free_parts import price_of_choices
from monitor.discovery.machine.shapes.refine import refine
from monitor.discovery.machine.shapes.variants import bends_of, part_of_bend, with_drivers
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import Evidence, best_of_families, weigh_beside
from monitor.discovery.search.projection import without
from monitor.discovery.search.rivals import coincides
from monitor.discovery.search.scan import except_for
from monitor.effects import ChainEffect, InstrumentEffect, parse_effect, with_time_constant
from monitor.effects.drivers import Always, EachRun, SettlingDriver
from monitor.effects.drivers.gravity import Gravity
from monitor.effects.drivers.run_time import RunTime
from monitor.effects.shapes import Compliance, Const, Cyclic, Harmonic, Sawtooth, Step
from monitor.effects.shapes.free import Free
from monitor.machine import COMPONENTS, MOTION, Chain
from monitor.records import Array

# A time constant between two of the grid may lose so much there; rivals are compared at their best value.
GRID_LOSS = 12.0
# Orders of a gear closer than this are the same: less than a turn of the joint shows no more.
ONE_ORDER = 2.0


@dataclass(frozen=True)
class RivalSearch:
    """The search for rivals of the ``selected`` effects, which are at their best values; ``drivers`` are those that the
    recorded columns allow."""

    scene: ChainScene
    selected: Sequence[ChainCandidate]
    drivers: Sequence[str]

    def rivals(self, index: int, least: float, coefficients: Array) -> list[tuple[ChainCandidate, bool]]:
        """Effects as likely as ``least`` instead of that at an index, and whether they coincide with it; these
        first."""
        others = except_for(self.selected, index)
        basis = self.scene.remainders.beside(others).basis
        remainder = without(basis, self.selected[index].columns) @ coefficients
        rivals = []
        for evidence in best_of_families(weigh_beside(self.scene, self._pool(index), others)):
            of_instrument = isinstance(evidence.candidate.effect, InstrumentEffect)
            if evidence.likelihood >= least - GRID_LOSS or of_instrument:
                best = self._at_best_value(index, evidence)
                if is_at_once(self.selected[index].effect, evidence.candidate.effect) and not isinstance(
                    best.candidate.effect.driver, SettlingDriver
                ):
                    # At its best it does not lag at all, and is no other; a lag may be as likely all the same.
                    best = evidence
                same = coincides(basis, best.candidate, remainder[:, None])
                # All three numbers of a nest may drift, one is enough: what it costs more rules nothing out.
                if best.likelihood >= least or (of_instrument and same):
                    rivals.append((best.candidate, same))
        named = {rival.family for rival, _ in rivals}
        axes = axes_as_likely(self.scene, self.selected[index], others, least)
        rivals += [(axis, False) for axis in axes if axis.family not in named]
        rivals += self._of_other_axes(index, least, {error_of(rival) for rival, _ in rivals}, remainder)
        rivals += self._without_products(index, least, {error_of(rival) for rival, _ in rivals}, remainder)
        # The pool may have an effect twice: as a part of a bend, say, and as the shape of another error.
        by_text: dict[str, tuple[ChainCandidate, bool]] = {}
        for rival, same in sorted(rivals, key=lambda pair: not pair[1]):
            by_text.setdefault(rival.effect.text, (rival, same))
        return list(by_text.values())

    def _of_other_axes(
        self, index: int, least: float, named: set[str], remainder: Array
    ) -> list[tuple[ChainCandidate, bool]]:
        """Free shapes of axes that go with that of the effect at an index, of errors that are not ``named`` yet, which
        are as likely as ``least`` with all parts paid for; ``remainder`` (M,) is what the effect does beside others."""
        candidate, others = self.selected[index], except_for(self.selected, index)
        basis = self.scene.remainders.beside(others).basis
        least -= price_of_choices(candidate)
        shapes = list(free_of_other_axes(self.scene, candidate, others))
        return [
            (evidence.candidate, coincides(basis, evidence.candidate, remainder[:, None]))
            for evidence in weigh_beside(self.scene, shapes, others)
            if error_of(evidence.candidate) not in named
            and evidence.likelihood - price_of_choices(evidence.candidate) >= least
        ]

    def _without_products(
        self, index: int, least: float, named: set[str], remainder: Array
    ) -> list[tuple[ChainCandidate, bool]]:
        """What errors that are not ``named`` yet do in place of products of a free shape at an index, as likely as
        ``least`` with all parts paid for; ``remainder`` (M,) is what that does beside others."""
        candidate, others = self.selected[index], except_for(self.selected, index)
        basis = self.scene.remainders.beside(others).basis
        least -= price_of_choices(candidate)
        return [
            (rival, coincides(basis, rival, remainder[:, None]))
            for rival in in_place_of_products(self.scene, candidate, others, least)
            if error_of(rival) not in named
        ]

    def _pool(self, index: int) -> list[ChainCandidate]:
        """The candidates that may be rivals: all that were searched, and the effect with each driver."""
        candidate = self.selected[index]
        families = {other.family for other in self.selected}
        pool = [
            rival
            for rival in self.scene.candidates
            if rival.family not in families and np.any(rival.columns) and not _same_cycle(rival, candidate)
        ]
        families |= {rival.family for rival in pool}
        variants = with_drivers(candidate.effect, self.drivers)
        context = self.scene.fit.problem.context
        if part_of_bend(candidate.effect, context) is not None:
            variants += bends_of(candidate.effect, context)
        variants += _of_other_errors(candidate.effect)
        variants += same_drift(candidate.effect, context.chain)
        variants += aliases_of(candidate.effect, context)
        variants += aliases_of_order(candidate.effect, context)
        runs = self.scene.fit.problem.runs
        if len(runs) >= FEWEST_RUNS:
            variants += in_one_run(candidate.effect, map(int, runs), len(runs))
        driven = scene_of(self.scene.fit, variants).candidates
        pool += [rival for rival in driven if rival.family not in families and np.any(rival.columns)]
        return [*pool, *scene_of(self.scene.fit, _below_grid(candidate.effect, pool)).candidates]

    def _at_best_value(self, index: int, evidence: Evidence[ChainCandidate]) -> Evidence[ChainCandidate]:
        """Evidence for a rival of the effect at an index with its searched value at its best."""
        if evidence.candidate.variant.tries == 1:
            return evidence
        trial = [*self.selected[:index], evidence.candidate, *self.selected[index + 1 :]]
        best = refine(self.scene, trial, index).candidate
        return weigh_beside(self.scene, [best], except_for(self.selected, index))[0]


def _of_other_errors(effect: MachineEffect) -> list[ChainVariant]:
    """The free shape or the wave of an effect as that of the other errors of its axis: no scan has these (of waves not
    those of many periods), and with one length of the tool a turn of a head and a shift of it move the tip alike."""
    if (
        not isinstance(effect, ChainEffect)
        or not isinstance(effect.shape, Free | Harmonic | Sawtooth | Step)
        or effect.term.stage != MOTION
    ):
        return []
    others = [
        replace(effect, term=replace(effect.term, symbol=f"E{letter}{effect.joint.name}", component=index))
        for index, letter in enumerate(COMPONENTS)
        if index != effect.term.component
    ]
    return [Variant(other.text, other) for other in others]


def same_drift(effect: MachineEffect, chain: Chain) -> list[ChainVariant]:
    """A drift of an axis as the same drift of every other: the catalogue has few of them, and one may stand for all.

    The growth of a spindle is told as that: it is what warms up first there. A drift with the time is anybody's.
    """
    if (
        not isinstance(effect, ChainEffect)
        or not isinstance(effect.shape, Const)
        or isinstance(effect.driver, Always | Gravity)
        or effect.term.stage != MOTION
        or (effect.joint.kind == "spindle" and not isinstance(effect.driver, RunTime))
    ):
        return []
    names = [joint.name for joint in chain.joints if joint != effect.joint]
    texts = [f"E{COMPONENTS[effect.term.component]}{name}:const@{effect.driver_text}" for name in names]
    # At the time constant of the effect, where it has one.
    others = [replace(parse_effect(text, chain), driver=effect.driver) for text in texts]
    return [Variant(other.text, other) for other in others]


def _below_grid(effect: MachineEffect, pool: Sequence[ChainCandidate]) -> list[ChainVariant]:
    """Rivals with the time constant of an effect where that is shorter than any of the grid, on which they lose far
    more than between two values of it."""
    driver = effect.driver
    if not isinstance(driver, SettlingDriver) or driver.time_constant_s is None:
        return []
    shortest: dict[str, tuple[float, ChainVariant]] = {}
    for rival in pool:
        other = rival.effect.driver
        if isinstance(other, SettlingDriver) and other.time_constant_s is not None:
            pair = (other.time_constant_s, rival.variant)
            shortest[rival.family] = min(shortest.get(rival.family, pair), pair, key=lambda each: each[0])
    return [
        replace(variant, effect=with_time_constant(variant.effect, driver.time_constant_s))
        for time_constant_s, variant in shortest.values()
        if driver.time_constant_s < time_constant_s
    ]


def _same_cycle(rival: ChainCandidate, candidate: ChainCandidate) -> bool:
    """Whether a rival is the search for the pitch or holds the load that a candidate has, or has all but its order."""
    effect, other = candidate.effect, rival.effect
    if not isinstance(effect, ChainEffect):
        return False
    if isinstance(other, ChainEffect) and effect.term == other.term:
        # Another load in every run holds one load in all of them.
        if isinstance(effect.shape, Compliance) and isinstance(other.driver, EachRun):
            return True
        orders = [part.shape.order for part in (effect, other) if isinstance(part.shape, Harmonic)]
        if len(orders) == 2 and max(orders) > 3 and abs(orders[0] - orders[1]) < ONE_ORDER:
            return True
    return isinstance(effect.shape, Cyclic) and rival.family == f"{effect.term.symbol}:cyclic"
