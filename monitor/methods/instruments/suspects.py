"""Who contradicts all others, and without whom nothing contradicts any more: one door for all that ask."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from monitor.methods.instruments.contrasts import comparisons_of
from monitor.methods.method import Contrast

#: What chance makes more often than this is doubtful: one in a hundred campaigns without fault may be told.
DOUBTFUL = 0.01


@dataclass(frozen=True)
class Contradicting:
    """``every`` contrast of a run, so many ``comparisons``, and those of them that are ``suspects``: without each of
    these nothing contradicts any more. Empty where no single one explains it."""

    every: tuple[Contrast, ...]
    comparisons: int
    suspects: tuple[Contrast, ...]


def who_contradicts(every: Sequence[Contrast], doubtful: float = DOUBTFUL) -> Contradicting | None:
    """Who of the contrasts of a run contradicts all others; None where chance makes as much more often than
    ``doubtful``, or nothing is compared."""
    comparisons = comparisons_of(every)
    if not every or min(each.p for each in every) * comparisons > doubtful:
        return None
    # Also those that contradict the others less surely: their direction may be one of many.
    explaining = [each for each in every if each.others_p is not None and each.others_p > doubtful]
    suspects = [each for each in explaining if not any(other.members < each.members for other in explaining)]
    return Contradicting(tuple(every), comparisons, tuple(suspects))
