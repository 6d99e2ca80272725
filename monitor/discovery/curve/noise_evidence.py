"""Evidence for effects of a curve against noise whose neighbouring rows resemble each other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from monitor.discovery.curve.scene import CurveCandidate, CurveScene
from monitor.records import Array
from monitor.statistics.noise import Assessed, assess, p_value_against_noise, p_value_in_noise

#: The two explanations do not nest, and F makes too much of the better one. Noise of ENSO's length (correlation 0.85 in
#: 40 % of the variance, what its annual cycle leaves) has two cycles as good as those of ENSO in 7.3 % of 300 series,
#: where F and the price of the search come to 2.8 %; of 200 series of slower noise (0.95) 5 % have some as good as
#: 0.3 %. Half the square root of what F says agrees with both within their scatter.
HALF = 0.5

#: Families of candidates in the model beside others, sorted.
Families = tuple[tuple[str, ...], tuple[str, ...]]


def _sorted_families(candidates: Sequence[CurveCandidate]) -> tuple[str, ...]:
    return tuple(sorted(candidate.family for candidate in candidates))


def _families(others: Sequence[CurveCandidate], together: Sequence[CurveCandidate]) -> Families:
    return _sorted_families(others), _sorted_families(together)


@dataclass(frozen=True)
class NoiseEvidence:
    """The p-values of effects of a scene, each computed once."""

    scene: CurveScene
    _p_values: dict[Families, float] = field(default_factory=dict)
    _odds: dict[Families, float] = field(default_factory=dict)

    def _columns(self, candidates: Sequence[CurveCandidate]) -> list[Array]:
        return [self.scene.curve.columns(candidate.effect) for candidate in candidates]

    def design(self, others: Sequence[CurveCandidate]) -> tuple[Array, Array]:
        """Response (m,) and columns (m, c) of the model with others, rows in the order of time."""
        fit, rows = self.scene.curve.fit, self.scene.curve.problem.order
        columns = np.column_stack([fit.design, *self._columns(others)])
        return fit.problem.curve.measured[rows], columns[rows]

    def p_value(self, others: Sequence[CurveCandidate], candidate: CurveCandidate) -> float:
        """Return p-value in correlated noise, the search paid for."""
        key = _families(others, [candidate])
        if key not in self._p_values:
            y, x = self.design(others)
            (columns,) = self._columns([candidate])
            p = p_value_in_noise(y, x, columns[self.scene.curve.problem.order])
            self._p_values[key] = min(1.0, p * candidate.variant.tries)
        return self._p_values[key]

    def p_value_in_white_noise(self, others: Sequence[CurveCandidate], candidate: CurveCandidate) -> float:
        """Return p-value in independent noise, the search paid for."""
        y, x = self.design(others)
        (columns,) = self._columns([candidate])
        p = p_value_in_noise(y, x, columns[self.scene.curve.problem.order], white=True)
        return p * candidate.variant.tries

    def odds(self, others: Sequence[CurveCandidate], together: Sequence[CurveCandidate]) -> float:
        """Return p-value of noise alone against effects together beside others, their search paid for."""
        key = _families(others, together)
        if key not in self._odds:
            y, x = self.design(others)
            columns = np.column_stack(self._columns(together))
            price = np.prod([float(candidate.variant.tries) for candidate in together])
            price = price / math.factorial(len(together))
            p = p_value_against_noise(y, x, columns[self.scene.curve.problem.order])
            self._odds[key] = p * float(price)
        return self._odds[key]

    def doubt(self, others: Sequence[CurveCandidate], together: Sequence[CurveCandidate]) -> float:
        """The rate at which noise alone would do as well as effects together beside others."""
        return HALF * math.sqrt(self.odds(others, together))

    def noise_after(self, selected: Sequence[CurveCandidate]) -> Assessed:
        """The noise that remains with the selected effects in the model."""
        return assess(*self.design(selected))
