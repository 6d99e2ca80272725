"""One shape of an error in place of several that follow it together.

A scan weighs widths and pitches on a grid: between two of its widths a play is a reversal and the wind-up of the next
width together, and one that dies away exponentially, which no entry is, takes a third. At its best width the one
wind-up may be the whole, or the error is of free shape. A width that was sought and does not do alone says that the
shape is another one; what is in the catalogue as it stands, a reversal beside a wave, say, is left as it is.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.shapes.alias_pitches import as_it_appears
from monitor.discovery.machine.shapes.bends import foretells_poses, score_beside
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.free_parts import (
    of_parts,
    parts_worth_keeping,
    price_of_parts,
    whole_basis,
)
from monitor.discovery.machine.shapes.refine import refine
from monitor.discovery.search.rivals import UNDECIDED
from monitor.discovery.search.scan import WORTH_EXCHANGING


def refined_instead(
    scene: ChainScene, several: Sequence[ChainCandidate], others: Sequence[ChainCandidate]
) -> ChainCandidate | None:
    """The one shape, at its best value or free, that says beside ``others`` more than ``several`` of its error at the
    price of the choice of each; None where none does, or where nothing of them was sought. A usual lead that looks
    longer at its positions is as good as sought: whatever is there one of them comes near to."""
    context = scene.fit.problem.context
    sought = [shape for shape in several if shape.variant.tries > 1]
    longer = [shape for shape in several if as_it_appears(shape.effect, context)]
    if len(several) < 2 or not (sought or longer):
        return None
    choice = 2.0 * float(np.log(scene.families))
    # A screw has one lead: each further one that looks longer has to be shown beyond doubt.
    margin = WORTH_EXCHANGING if len(longer) < 2 else -UNDECIDED * (len(longer) - 1)
    worth = score_beside(scene, several, others) - choice * len(several) + margin
    ones = [refine(scene, [*others, shape], len(others)).candidate for shape in sought]
    ones += _free(scene, several, others)

    def score(shape: ChainCandidate) -> float:
        return score_beside(scene, [shape], others) - (price_of_parts(shape) or choice)

    best = max(ones, key=score, default=None)
    return (
        best if best is not None and score(best) > worth and foretells_poses(scene, [best], others) else None
    )


def _free(
    scene: ChainScene, several: Sequence[ChainCandidate], others: Sequence[ChainCandidate]
) -> list[ChainCandidate]:
    """The error of several shapes in free shape, where that has no more parts than they have coefficients."""
    symbol = error_of(several[0])
    parts = parts_worth_keeping(scene, whole_basis(scene, symbol, several[0]), others)
    if not 0 < len(parts) <= sum(shape.columns.shape[1] for shape in several):
        return []
    return [of_parts(scene, symbol, parts, several, others)]
