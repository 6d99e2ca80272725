"""Whether a finding of the scan is believed: it must stand in correlated noise, lower Schwarz's criterion, not be a
bend that a polynomial does as well, and lower the error on rows that took no part in its fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.discovery.curve.candidates import at_best_value
from monitor.discovery.curve.noise_evidence import HALF, NoiseEvidence
from monitor.discovery.curve.plausible import is_plausible
from monitor.discovery.curve.scene import CurveCandidate, CurveScene
from monitor.discovery.search.acceptance import Acceptance
from monitor.discovery.search.evidence import Pool, pool_of, weigh_beside
from monitor.discovery.search.projection import orthonormal_to_full_precision, without
from monitor.discovery.search.scene import family_count
from monitor.effects.curve import SEARCHED, CurveEffect
from monitor.methods.curve.catalogue import POWERS
from monitor.methods.curve.fit import fit
from monitor.records import Array

#: Fewer cycles than these over the range of an input can be a bend.
MOST_BENDS = 2.0
#: A knee has to say more than a polynomial by twice the logarithm of 20: most bends of instruments are smooth.
KNEE_MARGIN = 6.0
#: Two periods of one input are separated from a whole cycle over its range on (Rayleigh's criterion).
APART = 1.0
#: An effect that stands out of the noise by itself has to be likelier than noise alone at this level too.
AGAINST_NOISE = 0.05
#: Effects that are asked together whether they, rather than noise, make neighbours resemble each other.
MOST_TOGETHER = 5
#: Effects in company that noise alone would bring forth in at most so many series are reported, as likely and with that
#: probability; they are certain where it is below the rate of the scan.
LIKELY = 0.1
#: A line and a cycle together: slow noise (correlation 0.97 and independent readings) is mistaken for them at 0.05 in
#: every fifth series of 100 rows.
LINE_AGAINST_NOISE = 1e-6


class CurveAcceptance(Acceptance[CurveCandidate]):
    """The rules of a search in a curve; ``doubts`` says by family how often noise alone would do as well as each effect
    that stood."""

    scene: CurveScene

    def __init__(self, scene: CurveScene, rate: float) -> None:
        super().__init__(scene)
        self.rate = rate
        self.families = family_count(scene)
        self.evidence = NoiseEvidence(scene)
        self.doubts: dict[str, float] = {}

    def accepts(self, others: Sequence[CurveCandidate], candidate: CurveCandidate) -> bool:
        """Whether an effect stands in noise, beside a line too, and lowers Schwarz's criterion and the held-out
        error."""
        line = self._line(others, candidate)
        if line is not None and not self.stands([*others, line], candidate):
            return False
        if not self.stands(others, candidate) or not self._lowers_bic(others, candidate):
            return False
        if self._is_a_bend(others, candidate) or not self.predicts(others, candidate):
            return False
        fitted = fit(
            self.scene.curve.fit.settled.with_effects([other.effect for other in (*others, candidate)])
        )
        return is_plausible(fitted, len(fitted.effects) - 1)

    def at_best_value(self, selected: Sequence[CurveCandidate], index: int) -> CurveCandidate:
        """The selected candidate at an index with its period or constant at the best value."""
        return at_best_value(self.scene, selected, index)

    def separable(
        self, selected: Sequence[CurveCandidate], candidates: Sequence[CurveCandidate]
    ) -> npt.NDArray[np.bool_]:
        """Those candidates whose period, if any, lies far enough from those in the model and selected."""
        problem = self.scene.curve.problem
        rates: dict[str, list[float]] = {name: [] for name in problem.inputs.numbers}
        for effect in (*problem.effects, *(candidate.effect for candidate in selected)):
            if effect.shape == "sin" and effect.value:
                rates[effect.column].append(1.0 / effect.value)
        spans = {name: float(np.ptp(problem.inputs.numbers[name])) for name in rates}

        def is_apart(effect: CurveEffect) -> bool:
            if effect.shape != "sin" or not effect.value:
                return True
            rate, least = 1.0 / effect.value, APART / spans[effect.column]
            return all(abs(other - rate) >= least for other in rates[effect.column])

        return np.array([is_apart(candidate.effect) for candidate in candidates], dtype=np.bool_)

    def outdoes(self, selected: Sequence[CurveCandidate], rival: CurveCandidate) -> bool:
        """Whether a rival still says something beside the selected ones, noise allowed for."""
        return self.stands_alone(selected, rival)

    def stands_alone(self, others: Sequence[CurveCandidate], candidate: CurveCandidate) -> bool:
        """Whether an effect stands out from correlated noise by itself, everything that was searched paid for."""
        return self.evidence.p_value(others, candidate) * self.families <= self.rate

    def stands(self, others: Sequence[CurveCandidate], candidate: CurveCandidate) -> bool:
        """Whether correlated noise is no better explanation.

        Alone: the effect stands out from the noise that its model leaves, and its model is likelier than noise
        alone. In company: a line and cycles of one input look like correlated noise as long as one of them is not in
        the model, so they are asked together, and the rows have to be independent once all are in.
        """
        family = candidate.family
        candidate = self.at_best_value([*others, candidate], len(others))
        if self.stands_alone(others, candidate) and self.evidence.odds(others, [candidate]) <= AGAINST_NOISE:
            doubt: float | None = self.evidence.p_value(others, candidate) * self.families
        else:
            doubt = self._doubt_in_company(others, candidate)
        if doubt is not None:
            self.doubts[family] = self.doubts[candidate.family] = doubt
        return doubt is not None

    def _doubt_in_company(self, others: Sequence[CurveCandidate], candidate: CurveCandidate) -> float | None:
        """The rate at which noise alone would produce a line or a cycle and what it needs beside it; None where that
        is too high, or the rows stay dependent."""
        effect = candidate.effect
        line = effect.order == 1
        if not (line or effect.shape == "sin"):
            return None
        if self.evidence.p_value_in_white_noise(others, candidate) * self.families > self.rate:
            return None
        cycles = [] if line else [other for other in others if _is_cycle(other, effect.column)]
        rest = [other for other in others if line or not _is_cycle(other, effect.column)]
        # Slow noise is a line and some cycles too: one cycle has to make a line plain.
        most = 2 if line else max(MOST_TOGETHER, len(cycles) + 1)
        level = LINE_AGAINST_NOISE if line else (LIKELY / HALF) ** 2
        return self._doubt_together(rest, [candidate, *cycles], most, level)

    def _doubt_together(
        self, rest: Sequence[CurveCandidate], together: list[CurveCandidate], most: int, level: float
    ) -> float | None:
        """The doubt of effects, with as many cycles of their input added as make the rows independent."""
        column = together[0].effect.column
        while len(together) <= most:
            likelier = len(together) > 1 and self.evidence.odds(rest, together) <= level
            if likelier and not self.evidence.noise_after([*rest, *together]).noticed:
                return self.evidence.doubt(rest, together)
            cycle = self._next_cycle([*rest, *together], column)
            if cycle is None:
                return None
            together = [*together, cycle]
        return None

    def _next_cycle(self, selected: Sequence[CurveCandidate], column: str) -> CurveCandidate | None:
        """The most convincing cycle of an input beside the selected candidates, at its best period."""
        families = {candidate.family for candidate in selected}
        weighed = weigh_beside(self.scene, self._pool, selected)
        able = self.separable(selected, [evidence.candidate for evidence in weighed])
        cycles = [
            evidence
            for evidence, is_able in zip(weighed, able, strict=True)
            if is_able
            and _is_cycle(evidence.candidate, column)
            and (evidence.candidate.effect.free or evidence.candidate.family not in families)
        ]
        if not cycles:
            return None
        # What explains most, whatever its price: the price is paid for all together.
        best = max(cycles, key=lambda evidence: evidence.explained).candidate
        return self.at_best_value([*selected, best], len(selected))

    @cached_property
    def _pool(self) -> Pool[CurveCandidate]:
        return pool_of(self.scene)

    def _line(self, others: Sequence[CurveCandidate], candidate: CurveCandidate) -> CurveCandidate | None:
        """The straight line in the same input, where it is not in the model yet: a bend must say something beside it,
        or the line is the simpler answer."""
        effect = candidate.effect
        if effect.order == 1:
            return None
        lines = (line for line in self._pool.candidates if line.effect.order == 1)
        line = next((other for other in lines if other.effect.column == effect.column), None)
        in_model = line is not None and any(other.effect == line.effect for other in others)
        return None if in_model else line

    def _remainder(self, effects: Sequence[CurveEffect]) -> tuple[float, int]:
        """Sum of squares that the model with further effects leaves of the response, and the rank of its columns.

        The lower powers that come along with a power count too.
        """
        settled, rows = self.scene.curve.fit.settled, self.scene.curve.problem.order
        columns = settled.columns([*settled.effects, *effects])[2][rows]
        return _remainder(settled.curve.measured[rows], columns)

    def _is_a_bend(self, others: Sequence[CurveCandidate], candidate: CurveCandidate) -> bool:
        """Whether a polynomial in the same input does as well at its price as a cycle, an exponential, a step or
        a knee: then it is the simpler answer and has its turn."""
        effect = candidate.effect
        if effect.shape not in SEARCHED:
            return False
        span = float(np.ptp(self.scene.curve.problem.inputs.numbers[effect.column]))
        if effect.shape == "sin" and span > MOST_BENDS * float(effect.value or 1.0):
            return False
        count, selected = len(self.scene.residual), [other.effect for other in others]
        polynomials = [CurveEffect(effect.column, f"poly{power}") for power in POWERS[1:]]
        criteria = []
        for last in (effect, *polynomials):
            squares, rank = self._remainder([*selected, last])
            price = (rank + (last is effect)) * np.log(count)
            criteria.append(count * np.log(max(squares, 1e-300)) + price)
        margin = KNEE_MARGIN if effect.shape == "knee" else 0.0
        return bool(min(criteria[1:]) <= criteria[0] + margin)

    def _lowers_bic(self, others: Sequence[CurveCandidate], candidate: CurveCandidate) -> bool:
        """Whether Schwarz's criterion of ordinary least squares falls: an effect that only shows in whitened rows
        takes next to nothing of the error away."""
        count, selected = len(self.scene.residual), [other.effect for other in others]
        before, rank_before = self._remainder(selected)
        after, rank_after = self._remainder([*selected, candidate.effect])
        price = (rank_after - rank_before + candidate.effect.free) * np.log(count)
        return bool(count * np.log(before / max(after, 1e-300)) > price)


def _is_cycle(candidate: CurveCandidate, column: str) -> bool:
    return candidate.effect.column == column and candidate.effect.shape == "sin"


def _remainder(y: Array, columns: Array) -> tuple[float, int]:
    """Sum of squares that columns leave of y, and their rank."""
    basis = orthonormal_to_full_precision(columns)
    return float(np.sum(without(basis, y[:, None]) ** 2)), basis.shape[1]
