"""Several powers of the position together, where an error of free shape would be told instead.

A guideway that bends about the middle of its travel is a parabola there, and a line and a parabola in the readings,
whose zero lies at one end. Neither of the two alone comes near, so that the scan is led to another error, and what
finds the right one is its free shape, which has more parts and no name.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.sizes import all_but_cancels
from monitor.discovery.search.amplitudes import amplitudes
from monitor.discovery.search.evidence import weigh_beside


def bends_instead(
    scene: ChainScene, symbol: str, worth: float, others: Sequence[ChainCandidate]
) -> list[ChainCandidate]:
    """The powers of the position that say together, beside others, at least as much of an error as its free shape, of
    which ``worth`` is the score at its price; none where no two or three do, or where they raise the error at poses
    left out."""
    powers = [shape for shape in scene.powers if error_of(shape) == symbol]
    together = [list(some) for size in (2, 3) for some in combinations(powers, size)]
    if not together:
        return []
    best = max(together, key=lambda some: score_beside(scene, some, others))
    if score_beside(scene, best, others) < worth or _all_but_cancel(scene, best, others):
        return []
    return best if foretells_poses(scene, best, others) else []


def foretells_poses(
    scene: ChainScene, effects: Sequence[ChainCandidate], others: Sequence[ChainCandidate]
) -> bool:
    """Whether effects beside others lower the error at poses left out of every run; true with too few poses."""
    before = scene.error_by_poses_beside(others)
    after = scene.held_out_error_by_poses(scene.columns([*others, *effects]))
    return before is None or after is None or after < before


def _all_but_cancel(
    scene: ChainScene, powers: Sequence[ChainCandidate], others: Sequence[ChainCandidate]
) -> bool:
    """Whether one of some powers is many times as large as what it takes of the error: it would be no finding, and the
    others alone describe nothing."""
    sizes = amplitudes(scene, [*others, *powers]).estimate[-len(powers) :]
    for index, (power, size) in enumerate(zip(powers, sizes, strict=True)):
        beside = [*others, *powers[:index], *powers[index + 1 :]]
        removed = weigh_beside(scene, [power], beside)[0].explained
        if all_but_cancels(scene, power, np.array([size]), removed):
            return True
    return False


def score_beside(
    scene: ChainScene, selected: Sequence[ChainCandidate], others: Sequence[ChainCandidate]
) -> float:
    """The score of effects together beside others, one after the other."""
    return sum(
        weigh_beside(scene, [candidate], [*others, *selected[:index]])[0].score
        for index, candidate in enumerate(selected)
    )
