"""Steps by their places in place of a free shape that is of nothing but steps.

The flexible basis has a step in the middle between every two hats. Where a hidden one lies near such a middle, that
part costs less than the entry whose place is searched, and says the same without saying where.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.shapes.bends import score_beside
from monitor.discovery.machine.shapes.scale_steps import steps_of
from monitor.discovery.search.rivals import UNDECIDED
from monitor.effects import ChainEffect
from monitor.effects.shapes.free import Follows, Free, parts_of_position


def steps_instead(
    scene: ChainScene, free: ChainCandidate, others: Sequence[ChainCandidate]
) -> list[ChainCandidate]:
    """The steps of an error that its free shape of steps alone does not rule out beside others; none where it has other
    parts. Both chose their places: coefficients are paid for, choices are not."""
    effect = free.effect
    steps = steps_of(scene, free)
    if steps is None or not isinstance(effect, ChainEffect) or not isinstance(effect.shape, Free):
        return []
    follows = effect.shape.following(scene.fit.problem.context, effect.term.joint)
    beyond_hats = np.array(effect.shape.parts) > parts_of_position(turns=False)
    if not np.all(beyond_hats & (follows == Follows.POSITION)):
        return []
    named = steps.beside(others)
    if not named:
        return []
    unpriced = score_beside(scene, named, others) + sum(2.0 * np.log(each.variant.tries) for each in named)
    return named if unpriced >= score_beside(scene, [free], others) - UNDECIDED else []
