"""Many profiles of one error, weighed without their whitened columns.

A profile says how large an error is at every row. What the machine does with the error is the same for all of them, so
that everything the evidence needs (what a run's own unknowns and selected effects take, what the residual says) are
products of the profile itself with numbers that are made once for the error: a third of the numbers and none of the
projections that whole columns take.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.scene_columns import AT_ONCE, ROUNDING
from monitor.discovery.search.candidate import SMALLEST_SHARE
from monitor.discovery.search.evidence import (
    BEYOND,
    ODDS_OF_TOO_LARGE,
    explained_by,
    least_remainder,
    scores_of,
)
from monitor.effects import ChainEffect
from monitor.effects.effect import ChainBasis
from monitor.methods.chain.shared_effects import largest_coefficient
from monitor.records import Array


@dataclass(frozen=True)
class Profiles:
    """Profiles (k, n) of an error: the ``lengths`` (k,) of their whitened columns without what every run's own unknowns
    can do, the ``shares`` (k,) that remain, and the ``largest`` (k,) coefficients that are likely."""

    profiles: Array
    lengths: Array
    shares: Array
    largest: Array


@dataclass(frozen=True)
class ErrorProfiles:
    """The error of an effect under a scene, in whatever profile."""

    scene: ChainScene
    effect: ChainEffect

    @cached_property
    def _direction(self) -> Array:
        """How the rows (n, d) move with the error."""
        term = self.effect.term
        direction: Array = self.scene.fit.observed_by_error[:, :, term.joint, term.stage, term.component]
        return direction

    @cached_property
    def _white(self) -> Array:
        """The same over the standard uncertainties of the numbers."""
        return np.asarray(self._direction / self.scene.fit.problem.sigma)

    @cached_property
    def _by_nuisance(self) -> Array:
        """Products (n, p) of a unit of the error at every row with the basis of what its run alone can do."""
        return np.asarray((self._white[:, None] @ self.scene.fit.nuisance_by_rows)[:, 0])

    def of(self, profiles: Array) -> Profiles:
        """Profiles (k, n) as the data see them."""
        before, taken = np.zeros((2, len(profiles)))
        peaks, run = np.zeros(len(profiles)), self.scene.fit.problem.context.run
        moved = np.sqrt(np.sum(self._direction**2, axis=1))
        for first in range(0, len(profiles), AT_ONCE):
            some = slice(first, first + AT_ONCE)
            before[some] = self._squares(profiles[some])
            peaks[some] = (np.abs(profiles[some]) * moved).max(axis=1, initial=0.0)
            for number in self.scene.fit.problem.runs:
                rows = run == number
                taken[some] += np.sum((profiles[some][:, rows] @ self._by_nuisance[rows]) ** 2, axis=1)
        before[peaks < ROUNDING] = 0.0
        remaining = np.maximum(before - taken, 0.0)
        limit = self.scene.fit.problem.largest_effect
        term = self.effect.term
        largest = [
            largest_coefficient(self.effect, ChainBasis(term, profile[:, None]), peak, limit)
            for profile, peak in zip(profiles, peaks.tolist(), strict=True)
        ]
        shares = np.sqrt(remaining / np.where(before > 0.0, before, np.inf))
        return Profiles(
            profiles, np.sqrt(np.where(remaining > 0.0, remaining, 1.0)), shares, np.array(largest)
        )

    def _squares(self, profiles: Array) -> Array:
        """The sums of squares (k,) of the whitened columns."""
        fit = self.scene.fit
        if fit.whitening is None:
            return np.asarray(profiles**2 @ np.sum(self._white**2, axis=1))
        white = np.moveaxis(fit.problem.padded(np.einsum("kn,nd->ndk", profiles, self._white)), 2, 0)
        extra = fit.solution.last.residual.shape[1] - white.shape[2]
        white = fit.whitening(np.pad(white, ((0, 0), (0, 0), (0, extra))))
        return np.asarray(np.einsum("krn,krn->k", white, white))

    def scores(self, weighable: Profiles, tries: int, others: Sequence[ChainCandidate]) -> Array:
        """The scores (k,) of profiles beside others, of so many that are tried; minus infinity where the data see
        none."""
        beside = self.scene.remainders.beside(others)
        total, dof = float(beside.residual @ beside.residual), beside.degrees_of_freedom
        runs, numbers = self.scene.fit.solution.last.residual.shape
        selected = np.column_stack([beside.basis, beside.residual]).reshape(runs, numbers, -1)
        by_rows = (self._white[:, None] @ self.scene.fit.by_rows(selected))[:, 0]
        onto = weighable.profiles @ by_rows / weighable.lengths[:, None]
        remainder = 1.0 - np.sum(onto[:, :-1] ** 2, axis=1)
        explained, rank, coefficients = explained_by(
            remainder[:, None, None], onto[:, -1:], total, dof, least_remainder(weighable.shares)
        )
        size = np.abs(coefficients[:, 0]) / weighable.lengths
        rank[(size > BEYOND * weighable.largest) | (weighable.shares <= SMALLEST_SHARE)] = 0
        odds = tries * np.where(size > weighable.largest, ODDS_OF_TOO_LARGE, 1.0)
        return scores_of(explained, rank, (total, dof), odds)
