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
from monitor.discovery.search.rivals import UNDECIDED
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
        beside, axes = best
        # Where a screw is held is part of its growth, as that of a plate is: beside the gains it pays its price alone.
        if all(accepts([*beside, *except_for(axes, index)], axes[index]) for index in (0, 1)):
            return scene, ScanResult(findings_of(scene, [*beside, *axes]))
    return scene, result


def _best_axes(
    scene: ChainScene, selections: Sequence[Sequence[ChainCandidate]], least: float
) -> tuple[Sequence[ChainCandidate], tuple[ChainCandidate, ...]] | None:
    """Which of several selections two axes say most beside, with these, ``least`` or more, and the axes; None where
    none does."""
    scored = []
    for beside in selections:
        for with_shifts in growing_axes(scene, beside):
            bare, *others = ((priced(scene, axes, beside), axes) for axes in with_shifts)
            best = max(others, key=lambda each: each[0], default=bare)
            # Shifts have to be shown; one that is left out where it is needed makes gains differ that are alike.
            worth, axes = best if best[0] > bare[0] + UNDECIDED else bare
            if len(axes) == 2 or _differ(scene, with_shifts[-1], beside):
                scored.append((priced(scene, beside) + worth, beside, axes))
    enough = sorted((each for each in scored if each[0] >= least), key=lambda each: each[0], reverse=True)
    return next(((beside, axes) for _, beside, axes in enough if _differ(scene, axes, beside)), None)


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

    every = (axes for with_shifts in growing_axes(scene, others) for axes in with_shifts)
    best = max(every, key=likelihood, default=())
    return list(best) if best and likelihood(best) >= least else []


def is_plate(candidate: ChainCandidate) -> bool:
    """Return whether an effect is the growth of a plate, held anywhere."""
    effect = candidate.effect
    return isinstance(effect, InstrumentEffect) and isinstance(effect.change, PlateExpansion)


def growing_axes(
    scene: ChainScene, others: Sequence[ChainCandidate]
) -> list[list[tuple[ChainCandidate, ...]]]:
    """Return all pairs of linear axes that grow by a driver by which plates grow too, none of them among others: of
    each pair the two, and the two with the shifts of one or both of them by that driver behind them."""
    drivers = [each.effect.driver for each in scene.candidates if is_plate(each)]
    taken = {other.family for other in others}
    free = [each for each in scene.candidates if each.visible and each.family not in taken]
    shifting = list(filter(_shifts, free))
    pairs = [
        (first, second)
        for first, second in combinations(filter(_grows, free), 2)
        if first.effect.driver == second.effect.driver
        and first.family != second.family
        and first.effect.driver in drivers
    ]
    return [[(*pair, *shifts) for shifts in _some(_shifts_of(pair, shifting))] for pair in pairs]


def _shifts_of(pair: Sequence[ChainCandidate], shifting: Sequence[ChainCandidate]) -> list[ChainCandidate]:
    """The shifts of two axes by the driver by which they grow."""
    symbols = {f"E{name[1]}0{name[1]}" for name in (each.family for each in pair)}
    driver = pair[0].effect.driver
    return [
        each for each in shifting if each.effect.driver == driver and each.family.partition("@")[0] in symbols
    ]


def _some(shifts: Sequence[ChainCandidate]) -> list[tuple[ChainCandidate, ...]]:
    """None of some shifts, each, and all of them."""
    return [some for size in range(len(shifts) + 1) for some in combinations(shifts, size)]


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
