"""Two axes that grow each by its own in place of a plate that does not grow so: two screws that warm up.

A plate that is held somewhere follows two axes of which one grows twice as much nearly as well as they do, where the
other coordinate goes on with time as the temperature does. As a plate grows alike along both, two axes that together
say more than it does, and grow by sizes that differ beyond their uncertainties, are told.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.shapes.free_parts import priced
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.search.amplitudes import amplitudes
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.scan import WORTH_EXCHANGING, ScanResult, findings_of
from monitor.effects import ChainEffect, InstrumentEffect
from monitor.effects.instrument.plate import PlateExpansion
from monitor.effects.shapes import Poly
from monitor.machine import MOTION

#: Whether the second is believed beside the first.
Accepts = Callable[[Sequence[ChainCandidate], ChainCandidate], bool]
# Sizes of two axes that grow alike differ by more than so many standard uncertainties in three of a thousand.
APART = 3.0


def axes_of_plate(scene: ChainScene, result: ChainScan, accepts: Accepts) -> tuple[ChainScene, ChainScan]:
    """The findings with two axes that grow by other sizes in place of a plate, where they say more at their price, or
    of a plate and an axis, where they say as much."""
    selected = result.candidates
    for plate in filter(is_plate, selected):
        several = [plate, *filter(_grows, selected)]
        others = [each for each in selected if all(each is not other for other in several)]
        margin = WORTH_EXCHANGING if len(several) == 1 else -WORTH_EXCHANGING
        worth = priced(scene, several, others) + margin
        pairs = [pair for pair in growing_axes(scene, others) if _differ(scene, pair, others)]
        best = max(pairs, key=lambda pair: priced(scene, pair, others), default=None)
        if best is None or priced(scene, best, others) < worth:
            continue
        first, second = best
        if accepts([*others, first], second) and accepts([*others, second], first):
            return scene, ScanResult(findings_of(scene, [*others, first, second]))
    return scene, result


def axes_as_likely(
    scene: ChainScene, plate: ChainCandidate, others: Sequence[ChainCandidate], least: float
) -> list[ChainCandidate]:
    """The two axes that together say most instead of a plate, where that is as likely as ``least``; none elsewhere."""
    if not is_plate(plate):
        return []

    def likelihood(pair: tuple[ChainCandidate, ChainCandidate]) -> float:
        first, second = pair
        return sum(
            weigh_beside(scene, [each], beside)[0].likelihood
            for each, beside in ((first, others), (second, [*others, first]))
        )

    best = max(growing_axes(scene, others), key=likelihood, default=())
    return list(best) if best and likelihood(best) >= least else []


def is_plate(candidate: ChainCandidate) -> bool:
    """Return whether an effect is the growth of a plate, held anywhere."""
    effect = candidate.effect
    return isinstance(effect, InstrumentEffect) and isinstance(effect.change, PlateExpansion)


def growing_axes(
    scene: ChainScene, others: Sequence[ChainCandidate]
) -> list[tuple[ChainCandidate, ChainCandidate]]:
    """Return all pairs of linear axes that grow by a driver by which plates grow too, none of them among others."""
    drivers = [each.effect.driver for each in scene.candidates if is_plate(each)]
    taken = {other.family for other in others}
    growing = [
        each for each in scene.candidates if each.visible and _grows(each) and each.family not in taken
    ]
    return [
        (first, second)
        for first, second in combinations(growing, 2)
        if first.effect.driver == second.effect.driver
        and first.family != second.family
        and first.effect.driver in drivers
    ]


def _grows(candidate: ChainCandidate) -> bool:
    """Whether an effect is the gain of a linear axis that follows a driver."""
    effect = candidate.effect
    if not isinstance(effect, ChainEffect) or not isinstance(effect.shape, Poly) or effect.joint.turns:
        return False
    is_gain = effect.term.stage == MOTION and effect.term.component == effect.joint.main
    return bool(is_gain and effect.shape.order == 1 and effect.driver_text)


def _differ(
    scene: ChainScene, pair: tuple[ChainCandidate, ChainCandidate], others: Sequence[ChainCandidate]
) -> bool:
    """Whether two axes grow by sizes that differ beyond their uncertainties."""
    fitted = amplitudes(scene, [*others, *pair])
    apart = np.array([1.0, -1.0])
    variance = float(apart @ fitted.covariance[-2:, -2:] @ apart)
    return bool(abs(apart @ fitted.estimate[-2:]) > APART * np.sqrt(variance))
