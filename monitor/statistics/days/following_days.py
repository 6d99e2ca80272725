"""How uncertain is a difference of two means of days if every day resembles the one before it?

Few days show neither that they are independent nor that they are not. The strongest correlation up to ``HIGHEST`` is
taken that the days themselves leave likely, with the likelihood of their deviations from the means of their stretches
(restricted: the means are fitted). The scatter of such days about their mean is too small, and the mean scatters more
than they show.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.statistics.serial import FirstOrder

#: Correlation of a day with the day before up to which a level is claimed.
HIGHEST = 0.6
GRID = np.arange(0.0, HIGHEST + 0.01, 0.1)
#: A correlation is left out where the logarithm of its likelihood is so far below the highest. Chosen with seed 1 of 2,
#: 1 and 0.5: days that follow each other by 0.6 are then called in 5 to 7 % (docs/trials-statistics.md).
REFUTED = 0.5


@dataclass(frozen=True)
class FollowingDays:
    """``u`` of the difference with ``dof`` (Satterthwaite), for days that follow each other by ``correlation``."""

    u: float
    dof: float
    correlation: float


@lru_cache(maxsize=64)
def _sums(n: int, r: float) -> tuple[float, float, float]:
    """Of the correlation matrix C (n, n): 1'C1, tr(CC) and 1'CC1."""
    index = np.arange(n)
    matrix = r ** np.abs(index[:, np.newaxis] - index)
    rows = matrix.sum(axis=1)
    return float(rows.sum()), float((matrix**2).sum()), float(rows @ rows)


def _scatter(lengths: list[list[int]], r: float) -> tuple[float, float]:
    """Expected sum of squares of the days about the means of their stretches, in variances of a day, and half of its
    variance: tr(MC) and tr(MCMC). ``lengths`` are those of the blocks of each stretch."""
    trace = square = 0.0
    for blocks in lengths:
        n = sum(blocks)
        whole, squares, products = np.sum([_sums(block, r) for block in blocks], axis=0)
        trace += n - whole / n
        square += squares - 2.0 * products / n + (whole / n) ** 2
    return trace, square


def _likelihoods(stretches: list[list[Array]], dof: int) -> Array:
    """Logarithm of the restricted likelihood of each correlation of ``GRID``, up to a constant."""
    result = np.empty(len(GRID))
    for i, r in enumerate(GRID):
        shape, weighted, determinant = FirstOrder(float(r)), 0.0, 0.0
        # Innovations have the variance 1 - r² of a day.
        innovation = 1.0 - r * r
        for blocks in stretches:
            ones = np.concatenate([shape.whiten(np.ones(len(block))) for block in blocks])
            days = np.concatenate([shape.whiten(block) for block in blocks])
            length = float(ones @ ones)
            weighted += (float(days @ days) - float(ones @ days) ** 2 / length) / innovation
            determinant += sum((len(block) - 1) * np.log(innovation) for block in blocks)
            determinant += np.log(length / innovation)
        result[i] = -0.5 * (dof * np.log(max(weighted, 1e-300)) + determinant)
    return result


def following_days(
    means: Array,
    stretch: npt.NDArray[np.intp],
    block: npt.NDArray[np.intp],
    sides: tuple[int, int],
    refuted: float = REFUTED,
) -> FollowingDays | None:
    """The difference of two sides by the means (d,) of days in the order of time.

    ``stretch`` (d,) are the pieces that scatter about a mean of their own, ``sides`` the two of them that are compared;
    ``block`` (d,) are campaigns, far apart from each other: a day resembles that before it in the same block only.
    Days of a block count as one after the other, whatever the time between. ``refuted`` is how far the logarithm of a
    correlation's likelihood lies below the highest where it is left out: more where a lower level is asked for. None
    where no stretch has two days.
    """
    dof = len(means) - len(np.unique(stretch))
    if dof == 0:
        return None
    stretches = [
        [means[(stretch == piece) & (block == part)] for part in np.unique(block[stretch == piece])]
        for piece in np.unique(stretch)
    ]
    likelihood = _likelihoods(stretches, dof)
    r = float(GRID[likelihood >= likelihood.max() - refuted].max())
    trace, square = _scatter([[len(days) for days in blocks] for blocks in stretches], r)
    squares = sum(float(((days - days.mean()) ** 2).sum()) for days in map(np.concatenate, stretches))
    variance = 0.0
    for side in sides:
        lengths = [int(((stretch == side) & (block == part)).sum()) for part in np.unique(block)]
        variance += sum(_sums(n, r)[0] for n in lengths if n) / sum(lengths) ** 2
    return FollowingDays(float(np.sqrt(squares / trace * variance)), trace**2 / square, r)
