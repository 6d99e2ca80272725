"""Risks of a decision about a tolerance where it is known how such parameters scatter (JCGM 106:2012, 9.5).

The specific risks of one result are its probabilities of conformity (``conformity``). The global ones are of the rule:
how often it accepts what is out of tolerance, and rejects what is in, over parameters that scatter as the process does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy

from monitor.exceptions import DataError

#: Points of the integral over the process and its half-width in standard deviations: 1e-9 of a probability.
_POINTS, _REACH = 4001, 8.0


@dataclass(frozen=True)
class GlobalRisks:
    """Probabilities: ``consumer`` to accept what does not conform, ``producer`` to reject what does, both of all."""

    consumer: float
    producer: float


@dataclass(frozen=True)
class Process:
    """How the true values of a parameter scatter over what is measured: normal about ``mean`` with ``spread``."""

    mean: float
    spread: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mean) and 0.0 < self.spread < math.inf):
            raise DataError(
                f"a process needs a finite mean and a positive spread, not {self.mean}, {self.spread}"
            )

    def risks(
        self, u: float, limits: tuple[float, float], acceptance: tuple[float, float] | None
    ) -> GlobalRisks:
        """Return the global risks of accepting estimates within ``acceptance`` for tolerance ``limits`` (9.5.2).

        Estimates scatter normally with ``u`` about the true value. Without an acceptance interval nothing is accepted.
        """
        low, high = limits
        edges = np.clip(
            [(limit - self.mean) / self.spread for limit in (-math.inf, low, high, math.inf)], -_REACH, _REACH
        )
        accepted = np.zeros(3)
        for index, (first, last) in enumerate(pairwise(edges)):
            if acceptance is None or last <= first:
                continue
            at = np.linspace(first, last, _POINTS)
            true = self.mean + self.spread * at
            inside = scipy.special.ndtr((acceptance[1] - true) / u) - scipy.special.ndtr(
                (acceptance[0] - true) / u
            )
            density = np.exp(-0.5 * at * at) / math.sqrt(2.0 * math.pi)
            step = (last - first) / (_POINTS - 1)
            accepted[index] = step * (
                np.sum(inside * density) - 0.5 * (inside[0] * density[0] + inside[-1] * density[-1])
            )
        conforming = float(scipy.special.ndtr(edges[2]) - scipy.special.ndtr(edges[1]))
        return GlobalRisks(float(accepted[0] + accepted[2]), conforming - float(accepted[1]))
