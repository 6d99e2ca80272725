"""What else may make two means of days differ that their own days do not show: the rivals of a change.

Each rival is a standard uncertainty of the difference with its degrees of freedom. A difference that independent days
of one scatter do not explain, but a rival does, is not decided. Days that follow each other are in ``following_days``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from monitor.records import Array
from monitor.statistics.days.following_days import REFUTED

#: A side of one day shows nothing of its scatter: up to so many times that of the other days is allowed for. Without
#: it up to 30 % of unchanged machines were called where it is three times (docs/trials-statistics.md).
WIDEST = 3.0
#: Probability below which a few days show less scatter than they have, where they lean on other days.
NOT_SHOWN = 0.2
#: Two campaigns show nothing of how campaigns differ beyond their days: up to so many times the scatter of the means of
#: days is allowed for. Chosen with seed 1 of 0, 0.7 and 0.8: with 0.7 twenty days a side are called in 9 %
#: (docs/trials-statistics.md).
CAMPAIGNS = 0.8
#: Probability of the expanded uncertainties.
LEVEL = 0.95


def factor(dof: float) -> float:
    """Return the coverage factor of Student's distribution for ``LEVEL``."""
    return -float(scipy.special.stdtrit(dof, (1.0 - LEVEL) / 2.0))


def satterthwaite(*parts: tuple[float, float]) -> float:
    """Return the degrees of freedom of a sum of variances with their own (GUM G.4.1); parts of none or of no size are
    left out."""
    squares = sum(variance**2 / dof for variance, dof in parts if dof)
    return sum(variance for variance, _ in parts) ** 2 / squares if squares > 0.0 else float(parts[0][1])


@dataclass(frozen=True)
class Allowance:
    """What is allowed for beside independent days of one scatter.

    ``refuted`` is that of ``following_days``; ``campaigns`` the standard deviation by which the two sides may differ as
    campaigns, in that of a mean of a day: 0 where a side holds many campaigns, or the times to look at are known.
    """

    refuted: float = REFUTED
    campaigns: float = CAMPAIGNS


@dataclass(frozen=True)
class Rival:
    """``u`` of the difference with ``dof``, by what the days of the sides do not exclude."""

    u: float
    dof: float

    @property
    def expanded(self) -> float:
        """Expanded uncertainty for ``LEVEL``."""
        return factor(self.dof) * self.u

    def p_value(self, difference: float) -> float:
        """Return the probability of a difference as large as this one."""
        return float(2.0 * scipy.special.stdtr(self.dof, -abs(difference) / self.u))


def two_scatters(first: Array, second: Array) -> Rival | None:
    """Each side by the scatter of its own means of days (d,); None where one has a single day or nothing scatters.

    Source: B. L. Welch, Biometrika 29 (1938) 350.
    """
    if min(len(first), len(second)) < 2:
        return None
    parts = [(float(side.var(ddof=1) / len(side)), len(side) - 1.0) for side in (first, second)]
    u = float(np.sqrt(sum(variance for variance, _ in parts)))
    return Rival(u, satterthwaite(*parts)) if u > 0.0 else None


def wider_side(sides: Sequence[Array], of_day: float) -> float:
    """Return what one side adds to the variance of the difference if its days scatter as widely as they may.

    ``sides`` are the means of days (d,) of each side, ``of_day`` the variance of such a mean by other days. A side may
    scatter by ``WIDEST`` times as much, or by the upper limit of what its own days show where that is less.
    """
    extra = 0.0
    for days in sides:
        ratio = WIDEST**2
        if len(days) > 1:
            quantile = float(scipy.special.chdtri(len(days) - 1, 1.0 - NOT_SHOWN))
            ratio = min(ratio, float(days.var(ddof=1)) * (len(days) - 1) / quantile / of_day)
        extra = max(extra, max(ratio - 1.0, 0.0) * of_day / len(days))
    return extra
