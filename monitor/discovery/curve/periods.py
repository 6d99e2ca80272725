"""Which periods of one input the rows can separate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from monitor.discovery.curve.scene import CurveCandidate
from monitor.effects.curve import CurveEffect
from monitor.methods.curve.problem import CurveProblem

#: Two periods of one input are separated from a whole cycle over its range on (Rayleigh's criterion).
APART = 1.0


def _rate(effect: CurveEffect) -> float | None:
    """Cycles per unit of the input; None for what is no period."""
    return 1.0 / effect.value if effect.shape == "sin" and effect.value else None


class SeparablePeriods:
    """The periods that lie far enough from those in the model and those selected before."""

    def __init__(self, problem: CurveProblem) -> None:
        self._problem = problem
        self._spans = {name: float(np.ptp(values)) for name, values in problem.inputs.numbers.items()}
        # The same for thousands of candidates in a row.
        self._latest: tuple[list[CurveEffect], dict[str, list[float]]] = ([], self._rates([]))

    def _rates(self, selected: Sequence[CurveEffect]) -> dict[str, list[float]]:
        """The rates of the periods by input."""
        rates: dict[str, list[float]] = {name: [] for name in self._spans}
        for effect in (*self._problem.effects, *selected):
            rate = _rate(effect)
            if rate is not None:
                rates[effect.column].append(rate)
        return rates

    def includes(self, selected: Sequence[CurveCandidate], candidate: CurveCandidate) -> bool:
        """Whether a candidate is no period, or one that can be separated from the selected ones."""
        effect, rate = candidate.effect, _rate(candidate.effect)
        if rate is None:
            return True
        effects = [other.effect for other in selected]
        if effects != self._latest[0]:
            self._latest = effects, self._rates(effects)
        least = APART / self._spans[effect.column]
        return all(abs(other - rate) >= least for other in self._latest[1][effect.column])
