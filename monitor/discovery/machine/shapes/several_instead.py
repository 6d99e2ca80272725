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
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.machine.shapes.unknown_shapes import price_of_parts
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.rivals import UNDECIDED
from monitor.discovery.search.scan import MOST_EFFECTS
from monitor.discovery.search.scene import family_count


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
    return (plain, several) if gain > UNDECIDED else with_shapes


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
