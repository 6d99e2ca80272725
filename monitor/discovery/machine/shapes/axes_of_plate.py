"""Two axes that grow each by its own in place of a plate that does not grow so: two screws that warm up.

A plate that is held somewhere follows two axes of which one grows twice as much nearly as well as they do, where the
other coordinate goes on with time as the temperature does. As a plate grows alike along both, two axes that together
say more than it does, and grow by sizes that differ beyond their uncertainties, are told. A screw grows from its fixed
bearing, which seldom stands at reading 0: beside its gain its axis is then shifted by the same driver.
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
from monitor.discovery.search.scan import WORTH_EXCHANGING, ScanResult, except_for, findings_of
from monitor.effects import ChainEffect, InstrumentEffect
from monitor.effects.instrument.plate import PlateExpansion
from monitor.effects.shapes import Const, Poly
from monitor.machine import LOCATION, MOTION

#: Whether the second is believed beside the first.
Accepts = Callable[[Sequence[ChainCandidate], ChainCandidate], bool]
# Sizes of two axes that grow alike differ by more than so many standard uncertainties in three of a thousand.
APART = 3.0


def axes_of_plate(scene: ChainScene, result: ChainScan, accepts: Accepts) -> tuple[ChainScene, ChainScan]:
    """The findings with two axes that grow by other sizes in place of a plate, where they say more at their price, or
    of a plate and an axis, where they say as much. What was found beside the plate stays, but for one effect that says
    nothing beside the axes."""
    selected = result.candidates
    for plate in filter(is_plate, selected):
        several = [plate, *filter(_grows, selected)]
        others = [each for each in selected if all(each is not other for other in several)]
        margin = WORTH_EXCHANGING if len(several) == 1 else -WORTH_EXCHANGING
        worth = priced(scene, selected) + margin
        best = _best_axes(
            scene, [others, *(except_for(others, index) for index in range(len(others)))], worth
        )
        if best is None:
            continue
        kept, axes = best
        # Where a screw is held is part of its growth, as that of a plate is: beside the gains it pays its price alone.
        if all(accepts([*kept, *except_for(axes, index)], axes[index]) for index in (0, 1)):
            return scene, ScanResult(findings_of(scene, [*kept, *axes]))
    return scene, result


def _best_axes(
    scene: ChainScene, beside: Sequence[Sequence[ChainCandidate]], least: float
) -> tuple[Sequence[ChainCandidate], tuple[ChainCandidate, ...]] | None:
    """Which of several selections ``beside`` two axes says most with these, ``least`` or more, and the axes; None where
    none does."""
    scores = [
        (score, kept, axes)
        for kept in beside
        for known in [priced(scene, kept)]
        for axes in growing_axes(scene, kept)
        if (score := known + priced(scene, axes, kept)) >= least
    ]
    for _, kept, axes in sorted(scores, key=lambda trial: trial[0], reverse=True):
        if _differ(scene, axes, kept):
            return kept, axes
    return None


def axes_as_likely(
    scene: ChainScene, plate: ChainCandidate, others: Sequence[ChainCandidate], least: float
) -> list[ChainCandidate]:
    """The two axes that together say most instead of a plate, where that is as likely as ``least``; none elsewhere."""
    if not is_plate(plate):
        return []

    def likelihood(axes: Sequence[ChainCandidate]) -> float:
        return sum(
            weigh_beside(scene, [axis], [*others, *axes[:index]])[0].likelihood
            for index, axis in enumerate(axes)
        )

    best = max(growing_axes(scene, others), key=likelihood, default=())
    return list(best) if best and likelihood(best) >= least else []


def is_plate(candidate: ChainCandidate) -> bool:
    """Return whether an effect is the growth of a plate, held anywhere."""
    effect = candidate.effect
    return isinstance(effect, InstrumentEffect) and isinstance(effect.change, PlateExpansion)


def growing_axes(scene: ChainScene, others: Sequence[ChainCandidate]) -> list[tuple[ChainCandidate, ...]]:
    """Return all pairs of linear axes that grow by a driver by which plates grow too, none of them among others; and
    each pair with the shifts of one or both of its axes by that driver, behind the two."""
    drivers = [each.effect.driver for each in scene.candidates if is_plate(each)]
    taken = {other.family for other in others}
    free = [each for each in scene.candidates if each.visible and each.family not in taken]
    growing, shifting = list(filter(_grows, free)), list(filter(_shifts, free))
    several: list[tuple[ChainCandidate, ...]] = []
    for pair in combinations(growing, 2):
        first, second = (each.effect for each in pair)
        if first.driver != second.driver or pair[0].family == pair[1].family or first.driver not in drivers:
            continue
        joints = [each.effect.joint for each in pair if isinstance(each.effect, ChainEffect)]
        beside = [
            each
            for each in shifting
            if isinstance(each.effect, ChainEffect)
            and each.effect.driver == first.driver
            and each.effect.joint in joints
        ]
        several += [(*pair, *some) for size in range(len(beside) + 1) for some in combinations(beside, size)]
    return several


def _grows(candidate: ChainCandidate) -> bool:
    """Whether an effect is the gain of a linear axis that follows a driver."""
    effect = candidate.effect
    if not isinstance(effect, ChainEffect) or not isinstance(effect.shape, Poly) or effect.joint.turns:
        return False
    is_gain = effect.term.stage == MOTION and effect.term.component == effect.joint.main
    return bool(is_gain and effect.shape.order == 1 and effect.driver_text)


def _shifts(candidate: ChainCandidate) -> bool:
    """Whether an effect is the place of a linear axis along itself that follows a driver."""
    effect = candidate.effect
    if not isinstance(effect, ChainEffect) or not isinstance(effect.shape, Const) or effect.joint.turns:
        return False
    return bool(
        effect.term.stage == LOCATION and effect.term.component == effect.joint.main and effect.driver_text
    )


def _differ(scene: ChainScene, axes: Sequence[ChainCandidate], others: Sequence[ChainCandidate]) -> bool:
    """Whether the two axes, with their shifts behind them, grow by sizes that differ beyond their uncertainties."""
    fitted = amplitudes(scene, [*others, *axes])
    apart = np.array([1.0, -1.0, *np.zeros(len(axes) - 2)])
    variance = float(apart @ fitted.covariance[-len(axes) :, -len(axes) :] @ apart)
    return bool(abs(apart @ fitted.estimate[-len(axes) :]) > APART * np.sqrt(variance))
