"""Did a quantity step at an event, beyond what its machine drifts by and wanders between campaigns?

Where campaigns say what the machine does between events (``stepped_line``), they judge; where there are two or three of
them, the days do (``before_after``), but only if the machine stands still where no event is; where none is left, the
days alone. What the days call and the campaigns do not is explained by the drift if one is seen, else undecided.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from monitor.statistics.days.before_after import BeforeAfter
from monitor.statistics.days.rival_scatter import WIDEST, wider_side
from monitor.statistics.days.stepped_line import NEAREST, Campaigns, SteppedLine, moves, stepped_line

#: Degrees of freedom within campaigns from which on these say how the days of one scatter.
DAYS_THAT_SAY = 3
#: A machine stands still where it moves between campaigns by less than this part of what a step has to exceed: of one
#: pair of neighbours, of two and more. With these a random walk of any size is called in at most 8 and 5 % at 5 %:
#: the largest of P(|d| < c)^m P(|d| > 1) over the size of its steps d.
STILL = (0.25, 0.5)


class Verdict(StrEnum):
    """What is said of a step: ``DAYS`` and ``DRIFT`` may do as much by themselves."""

    STEPPED = "stepped"
    NOT_SEEN = "not seen"
    DAYS = "days"
    DRIFT = "drift"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class BesideDrift:
    """``days`` of both sides compared (None: they say nothing), and the ``line`` of the campaigns (None: too few).

    ``widest`` is the variance that a side of few campaigns or days adds to that of the step. Between ``pairs`` of
    campaigns without an event the machine moved by up to ``moved``.
    """

    days: BeforeAfter | None
    line: SteppedLine | None
    widest: float
    moved: float
    pairs: int

    def verdict(self, level: float) -> Verdict:
        """What is said of the step at a ``level`` of false calls."""
        called = self._by_days(level)
        if self.line is None:
            if called is not Verdict.STEPPED or not self.pairs:
                return called
            assert self.days is not None
            still = self.moved < STILL[min(self.pairs, 2) - 1] * self.days.limit(level)
            return Verdict.STEPPED if still else Verdict.DRIFT
        if self.line.p_value() < level:
            return Verdict.STEPPED if self.line.p_value(self.widest) < level else Verdict.DAYS
        if called in (Verdict.NOT_SEEN, Verdict.UNKNOWN) or self.line.drifts:
            return Verdict.NOT_SEEN
        return Verdict.DRIFT

    def _by_days(self, level: float) -> Verdict:
        if self.days is None or not self.days.decided:
            return Verdict.UNKNOWN
        if self.days.p_value() >= level:
            return Verdict.NOT_SEEN
        return Verdict.STEPPED if self.days.p_value_of_rivals() < level else Verdict.DAYS


def beside_drift(
    days: BeforeAfter | None, campaigns: Campaigns, before: int, after: int, *, levels: bool
) -> BesideDrift:
    """Judge the step between the campaigns ``before`` and ``after`` (indices), as ``stepped_line`` does.

    With ``levels`` the sides are the whole pieces of the history that the two campaigns lie in.
    """
    line = stepped_line(campaigns, before, after, levels=levels)
    widest = 0.0 if line is None else _widest(campaigns, line, before, after, levels)
    return BesideDrift(days, line, widest, *moves(campaigns, before, after, levels=levels))


def _widest(campaigns: Campaigns, line: SteppedLine, before: int, after: int, levels: bool) -> float:
    """The variance that a side adds if its days or campaigns scatter as widely as they may."""
    about = campaigns.mean - line.rate * campaigns.t
    index = np.arange(len(about))
    near = (index > before - NEAREST) & (index < after + NEAREST)
    sides = [index[near & (campaigns.piece == campaigns.piece[end])] for end in (before, after)]
    squares = sum(float(((about[side] - about[side].mean()) ** 2).sum()) for side in sides)
    of_campaign = squares / max(sum(len(side) - 1 for side in sides), 1)
    # That one side scatters more is allowed for, not that both do.
    return max(
        wider_side([about[side]], of_campaign) * (1 if levels else len(side))
        if len(side) > 1 and of_campaign > 0.0
        else _of_one(campaigns, int(side[0]), line.u**2 / 2.0)
        for side in sides
    )


def _of_one(campaigns: Campaigns, index: int, of_campaign: float) -> float:
    """The variance that a side of one campaign adds: by its days where these say how days scatter."""
    variance, dof = campaigns.of_day
    days = campaigns.days[index]
    if dof < DAYS_THAT_SAY or variance == 0.0:
        return (WIDEST**2 - 1.0) * of_campaign
    return wider_side([days], variance)
