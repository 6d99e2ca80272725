"""Whether a finding of the scan is believed: it must stand in correlated noise, lower Schwarz's criterion, not be a
bend that a polynomial does as well, and lower the error on rows that took no part in its fit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from monitor.discovery.curve.candidates import POWERS, at_best, separable
from monitor.discovery.curve.quality import folds
from monitor.discovery.curve.scene import Scene, effect_of, orthonormal_to_full_precision
from monitor.discovery.machine.evidence import Pool, weigh, without
from monitor.discovery.machine.held_out import held_out_rms
from monitor.discovery.machine.visible import SMALLEST_SHARE, Candidate, Visible
from monitor.effects.curve import SEARCHED, CurveEffect
from monitor.records import Array
from monitor.statistics.noise import Assessed, assess, p_value_against_noise, p_value_in_noise

#: Fewer cycles than these over the range of an input can be a bend.
MOST_BENDS = 2.0
#: An effect that stands out of the noise by itself has to be likelier than noise alone at this level too.
AGAINST_NOISE = 0.05
#: Effects that are asked together whether they, rather than noise, make neighbours resemble each other.
MOST_TOGETHER = 5
#: The two explanations do not nest, and F makes too much of the better one. Noise of ENSO's length (correlation 0.85 in
#: 40 % of the variance, what its annual cycle leaves) has two cycles as good as those of ENSO in 7.3 % of 300 series,
#: where F and the price of the search come to 2.8 %; of 200 series of slower noise (0.95) 5 % have some as good as
#: 0.3 %. Half the square root of what F says agrees with both within their scatter.
HALF = 0.5
#: Effects in company that noise alone would bring forth in at most so many series are told, as likely and with that
#: probability; they count as found where it is below the rate of the scan.
LIKELY = 0.1
#: A line and a cycle together: slow noise (correlation 0.97 and independent readings) is taken for them at 0.05 in
#: every fifth series of 100 rows.
LINE_AGAINST_NOISE = 1e-6


@dataclass
class Acceptance:
    """The last word on a finding; keeps in ``doubts`` how often noise alone would do as well as each effect that
    stood."""

    scene: Scene
    visible: Visible
    rate: float
    doubts: dict[str, float] = field(default_factory=dict)
    known: dict[tuple[str, ...], float] = field(default_factory=dict)
    odds: dict[tuple[tuple[str, ...], tuple[str, ...]], float] = field(default_factory=dict)

    def is_a_bend(self, others: Sequence[Candidate], found: Candidate) -> bool:
        """Whether a polynomial in the same input does as well at its price as a cycle, an exponential or a step: then
        it is the simpler answer and has its turn."""
        effect = effect_of(found)
        x = self.scene.fit.problem.inputs.numbers.get(effect.column, np.zeros(1))
        many = effect.shape == "sin" and float(np.ptp(x)) > MOST_BENDS * float(effect.value or 1.0)
        if effect.shape not in SEARCHED or many:
            return False
        problem, rows = self.scene.fit.settled, self.scene.fit.problem.order
        y = problem.curve.measured[rows]
        chosen = [effect_of(one) for one in others]
        ends = []
        for last in (effect, *(CurveEffect(effect.column, f"poly{power}") for power in POWERS[1:])):
            left, rank = _left(y, problem.columns([*problem.effects, *chosen, last])[2][rows])
            ends.append(len(y) * np.log(max(left, 1e-300)) + (rank + (last is effect)) * np.log(len(y)))
        return bool(min(ends[1:]) <= ends[0])

    def line(self, others: Sequence[Candidate], found: Candidate) -> Candidate | None:
        """The straight line in the same input, where it is not in the model yet: a bend must say something beside it,
        or the line is the simpler answer."""
        column = effect_of(found).column
        for one in self.pool.candidates:
            effect = effect_of(one)
            if effect.column == column and effect.order == 1 and effect_of(found).order != 1:
                return None if any(effect_of(other) == effect for other in others) else one
        return None

    @cached_property
    def pool(self) -> Pool:
        return Pool(tuple(one for one in self.visible.candidates if one.share > SMALLEST_SHARE))

    def falls(self, others: Sequence[Candidate], found: Candidate) -> bool:
        """Whether Schwarz's criterion of ordinary least squares falls: an effect that only shows in whitened rows
        takes next to nothing of the error away."""
        fitted, rows = self.scene.fit, self.scene.fit.problem.order
        y = fitted.problem.curve.measured[rows]
        problem, chosen = fitted.settled, [effect_of(one) for one in others]
        # The lower powers that come along with a power count too.
        before = _left(y, problem.columns([*problem.effects, *chosen])[2][rows])
        after = _left(y, problem.columns([*problem.effects, *chosen, effect_of(found)])[2][rows])
        price = (after[1] - before[1] + effect_of(found).free) * np.log(len(y))
        return bool(len(y) * np.log(before[0] / max(after[0], 1e-300)) > price)

    @cached_property
    def families(self) -> int:
        """How many kinds of effects are looked at."""
        return len({one.family for one in self.visible.candidates if one.share > SMALLEST_SHARE})

    def p_value(self, others: Sequence[Candidate], found: Candidate) -> float:
        """In correlated noise, everything that was searched paid for."""
        fitted, rows = self.scene.fit, self.scene.fit.problem.order
        columns = [fitted.design, *(self.scene.columns(effect_of(one)) for one in others)]
        key = (found.family, *sorted(one.family for one in others))
        if key in self.known:
            return self.known[key]
        measured = fitted.problem.curve.measured
        p = p_value_in_noise(
            measured[rows], np.column_stack(columns)[rows], self.scene.columns(effect_of(found))[rows]
        )
        self.known[key] = min(1.0, p * found.variant.tries)
        return self.known[key]

    def stands(self, others: Sequence[Candidate], found: Candidate) -> bool:
        """Whether correlated noise is no better explanation.

        Alone: the effect stands out from the noise that its model leaves, and its model is likelier than noise
        alone. In company: a line and cycles of one input look like correlated noise as long as one of them is not in
        the model, so they are asked together, and the rows have to be independent once all are in.
        """
        asked = found.family
        found = at_best(self.scene, self.visible, [*others, found], len(others))
        p = self.p_value(others, found)
        if p * self.families <= self.rate and self.likelier(others, [found], AGAINST_NOISE):
            doubt: float | None = p * self.families
        else:
            doubt = self.in_company(others, found)
        if doubt is not None:
            self.doubts[asked] = self.doubts[found.family] = doubt
        return doubt is not None

    def in_company(self, others: Sequence[Candidate], found: Candidate) -> float | None:
        """How often noise alone would bring forth a line or a cycle and what it needs beside it; None where that is too
        often, or the rows stay dependent."""
        line = effect_of(found).order == 1
        if not (line or effect_of(found).shape == "sin"):
            return None
        if self.alone(others, found) * self.families > self.rate:
            return None
        kind = (effect_of(found).column, "sin")
        same = (
            [] if line else [one for one in others if (effect_of(one).column, effect_of(one).shape) == kind]
        )
        rest = [one for one in others if one not in same]
        together = [found, *same]
        # Slow noise is a line and some cycles too: one cycle has to make a line plain.
        most = 2 if line else max(MOST_TOGETHER, len(same) + 1)
        level = LINE_AGAINST_NOISE if line else (LIKELY / HALF) ** 2
        while len(together) <= most:
            enough = len(together) > 1 and self.likelier(rest, together, level)
            if enough and not self.noise_after([*rest, *together]).noticed:
                return self.doubt_of_all(rest, together)
            more = self.next_one([*rest, *together], kind)
            if more is None:
                return None
            together.append(more)
        return None

    def design(self, others: Sequence[Candidate]) -> tuple[Array, Array]:
        """Response (m,) and columns (m, c) of the model with others, rows in the order of time."""
        fitted, rows = self.scene.fit, self.scene.fit.problem.order
        columns = [fitted.design, *(self.scene.columns(effect_of(one)) for one in others)]
        return fitted.problem.curve.measured[rows], np.column_stack(columns)[rows]

    def likelier(self, others: Sequence[Candidate], together: Sequence[Candidate], level: float) -> bool:
        """Whether effects together, their search paid for, explain the rows better than noise alone."""
        key = _key(others, together)
        if key not in self.odds:
            y, x = self.design(others)
            added = np.column_stack([self.scene.columns(effect_of(one)) for one in together])
            price = np.prod([float(one.variant.tries) for one in together]) / math.factorial(len(together))
            self.odds[key] = p_value_against_noise(y, x, added[self.scene.fit.problem.order]) * float(price)
        return self.odds[key] <= level

    def doubt_of_all(self, others: Sequence[Candidate], together: Sequence[Candidate]) -> float:
        """How often noise alone would do as well as effects together beside others."""
        self.likelier(others, together, LIKELY)
        return HALF * math.sqrt(self.odds[_key(others, together)])

    def alone(self, others: Sequence[Candidate], found: Candidate) -> float:
        """p-value in independent noise, the search paid for."""
        y, x = self.design(others)
        own = self.scene.columns(effect_of(found))[self.scene.fit.problem.order]
        return p_value_in_noise(y, x, own, white=True) * found.variant.tries

    def noise_after(self, chosen: Sequence[Candidate]) -> Assessed:
        """The noise that is left with the chosen ones in the model."""
        return assess(*self.design(chosen))

    def next_one(self, chosen: Sequence[Candidate], kind: tuple[str, str]) -> Candidate | None:
        """The most convincing candidate of a kind (column, shape) beside the chosen ones, at its best value."""
        stack = np.concatenate([self.visible.added, *(one.columns for one in chosen)], axis=1)
        taken = {one.family for one in chosen}
        apart = separable(self.scene.fit.problem)
        found = weigh(self.pool, self.visible.residual, stack, self.visible.degrees_of_freedom)
        # What explains most, whatever its price: the price is paid for all together.
        for one in sorted(found, key=lambda one: -one.explained):
            effect = effect_of(one.candidate)
            if (effect.column, effect.shape) != kind or (one.candidate.family in taken and not effect.free):
                continue
            if apart(chosen, one.candidate):
                return at_best(self.scene, self.visible, [*chosen, one.candidate], len(chosen))
        return None

    def __call__(self, others: Sequence[Candidate], found: Candidate) -> bool:
        line = self.line(others, found)
        if line is not None and not self.stands([*others, line], found):
            return False
        if not self.stands(others, found) or not self.falls(others, found) or self.is_a_bend(others, found):
            return False
        before = np.concatenate([self.visible.added, *(one.columns for one in others)], axis=1)
        after = np.concatenate([before, found.columns], axis=1)
        fold = folds(len(self.visible.residual))
        dof = self.visible.degrees_of_freedom
        one = held_out_rms(self.visible.residual, before, fold, dof, 1.0)
        two = held_out_rms(self.visible.residual, after, fold, dof, 1.0)
        return one is None or two is None or two < one


def _key(
    others: Sequence[Candidate], together: Sequence[Candidate]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    return tuple(sorted(one.family for one in others)), tuple(sorted(one.family for one in together))


def _left(y: Array, columns: Array) -> tuple[float, int]:
    """Sum of squares that columns leave of y, and their rank."""
    basis = orthonormal_to_full_precision(columns)
    return float(np.sum(without(basis, y[:, None]) ** 2)), basis.shape[1]
