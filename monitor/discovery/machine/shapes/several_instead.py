"""Several effects of the catalogue in place of an error of free shape.

With few indexations one error in any shape does what two errors of turning axes do together, so that the second of them
stands nowhere beside the first one in any shape. Which of both it was is decided by their likelihoods at their prices:
eight parts of a shape cost more than three harmonics.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.free_parts import price_of_parts
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.rivals import UNDECIDED
from monitor.discovery.search.scan import MOST_EFFECTS
from monitor.discovery.search.scene import family_count

#: What is left of readings that are explained, in stated standard uncertainties, beside small effects.
NEAR_NOISE = 2.0


def several_instead(
    plain: ChainScene, with_shapes: tuple[ChainScene, ChainScan], search: Callable[[], ChainScan]
) -> tuple[ChainScene, ChainScan]:
    """The scene and the findings ``with_shapes``, or the ``plain`` scene with those of a ``search`` that lets each
    effect stand beside the others whatever shape their errors might have, where these say more beyond doubt."""
    scene, result = with_shapes
    if not any(price_of_parts(candidate) for candidate in result.candidates):
        return with_shapes
    several = search()
    errors = {error_of(candidate) for candidate in several.candidates}
    # A search that ends at its limit has not shown that a shape is not what it goes on to take apart.
    if len(errors) < 2 or len(several.candidates) >= MOST_EFFECTS:
        return with_shapes
    gain = _worth(plain, several) - _worth(scene, result)
    foretells = _foretells_as_well((plain, several), with_shapes)
    return (plain, several) if gain > UNDECIDED and foretells else with_shapes


def _foretells_as_well(several: tuple[ChainScene, ChainScan], shaped: tuple[ChainScene, ChainScan]) -> bool:
    """Whether several effects foretell what was left out, runs and poses, no worse than a free shape, and nearly to the
    noise: where far more is left, likelihoods at the stated noise decide nothing."""
    most = NEAR_NOISE * several[0].fit.sigma
    errors = [
        [held_out(scene.columns(result.candidates)) for held_out in scene.held_out_errors]
        for scene, result in (several, shaped)
    ]
    return all(
        ours is None or ours <= min(most, np.inf if other is None else other)
        for ours, other in zip(*errors, strict=True)
    )


def _worth(scene: ChainScene, result: ChainScan) -> float:
    """The score of findings together, one after the other, at the price of the choice of each among all families, and
    of the parts of a shape."""
    selected: list[ChainCandidate] = result.candidates
    scores = [
        weigh_beside(scene, [candidate], selected[:index])[0].score
        for index, candidate in enumerate(selected)
    ]
    of_families = 2.0 * len(selected) * float(np.log(family_count(scene)))
    return sum(scores) - of_families - sum(map(price_of_parts, selected))
