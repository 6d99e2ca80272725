"""A plate that grows in place of several effects that follow its driver: two axes that warm up alike are the plate.

A plate or part that warms up while it is measured goes apart from where it is clamped, which nobody wrote down. Seen
from the middle it drifts besides, seen from the machine two axes grow alike. Of the growth about any point, one and a
shift that follows the same driver, the size and the place where it is held are linear, and told as one effect.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.shapes.free_parts import priced
from monitor.discovery.machine.shapes.held_place import ARM_MM, held_at, with_shifts
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.search.amplitudes import amplitudes
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.rivals import UNDECIDED
from monitor.discovery.search.scan import WORTH_EXCHANGING, ScanResult, findings_of
from monitor.effects import InstrumentEffect
from monitor.effects.instrument.plate import PlateExpansion

#: Whether the second is believed beside the first.
Accepts = Callable[[Sequence[ChainCandidate], ChainCandidate], bool]
# A plate is held within this many travels of the axes about their middle, or its place is not seen.
WITHIN_TRAVELS = 3.0


def plate_instead(scene: ChainScene, result: ChainScan, accepts: Accepts) -> tuple[ChainScene, ChainScan]:
    """The findings with the growth of a plate in place of one to three of which one follows its driver, where it is
    accepted: in place of one where it says more at its price, in place of several where the data do not decide for
    these, for that several causes come together so has to be shown."""
    selected = result.candidates
    for several in [some for size in (3, 2, 1) for some in combinations(selected, size)]:
        others = [each for each in selected if all(each is not other for other in several)]
        margin = -UNDECIDED * (len(several) - 1) if len(several) > 1 else WORTH_EXCHANGING
        worth = priced(scene, several, others) + margin
        held = [_held(scene, plate, others) for plate in _plates(scene, several)]
        for evidence in weigh_beside(scene, [each for each in held if each is not None], others):
            if evidence.score >= worth and accepts(others, evidence.candidate):
                scene = replace(scene, candidates=(*scene.candidates, evidence.candidate))
                return scene, ScanResult(findings_of(scene, [*others, evidence.candidate]))
    return scene, result


def _plates(scene: ChainScene, several: Sequence[ChainCandidate]) -> list[ChainCandidate]:
    """Plates that grow by a driver of one of several effects."""
    drivers = {each.effect.driver_text for each in several} - {""}
    return [
        each
        for each in scene.candidates
        if each.visible and _is_plate(each) and each.effect.driver_text in drivers
    ]


def _is_plate(candidate: ChainCandidate) -> bool:
    """Whether a candidate is the growth of a plate about its middle."""
    effect = candidate.effect
    return (
        isinstance(effect, InstrumentEffect)
        and isinstance(effect.change, PlateExpansion)
        and not effect.change.held
    )


def _held(
    scene: ChainScene, plate: ChainCandidate, others: Sequence[ChainCandidate]
) -> ChainCandidate | None:
    """The plate that is held where that says most beside others; None where that is nowhere near."""
    context = scene.fit.problem.context
    axes = [
        (joint.name, joint.sign * context.positions[:, index])
        for index, joint in enumerate(context.chain.joints)
        if not joint.turns and np.ptp(context.positions[:, index]) > 0.0
    ]
    middle = np.array([float(reading.min() + reading.max()) / 2.0 for _, reading in axes])
    travel = np.array([float(np.ptp(reading)) for _, reading in axes])

    names = [name for name, _ in axes]
    together = with_shifts(scene, plate, names, middle)
    growth, *shifts = amplitudes(scene, [*others, together]).estimate[-len(axes) - 1 :]
    if not growth:
        return None
    best = middle + ARM_MM * np.array(shifts) / growth
    if np.any(np.abs(best - middle) > WITHIN_TRAVELS * travel):
        return None
    # Each number of the place is at the price of a coefficient: half the logarithm of the degrees of freedom a try.
    dof = scene.degrees_of_freedom
    return held_at(scene, plate, names, best, round(dof ** (len(axes) / 2.0)))
