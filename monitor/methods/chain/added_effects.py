"""Added effects and their unknowns, shared by all runs; unknown time constants are unknowns of the fit like any other.

An effect ``@warmup`` or ``@lagged_...`` without a time constant has one more common unknown, the logarithm of it in
seconds, so that it stays positive. Its derivative is taken numerically: the basis is a smooth function of it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np

from monitor.effects import Basis, Context, Effect, ParsedEffect, with_time_constant
from monitor.effects.drivers import SettlingDriver
from monitor.records import Array

# Starts for the search: from the warm-up of a small spindle to that of a machine bed.
STARTS_S = (600.0, 2400.0, 9600.0)
# Beyond these the exponential is a step or a straight line within a day, and the constant means nothing.
SHORTEST_S, LONGEST_S = 30.0, 864_000.0
# Half the relative step of the numerical derivative.
STEP = 1e-4


def is_searched(effect: Effect) -> bool:
    """Whether the effect's time constant has to be estimated."""
    driver = effect.driver if isinstance(effect, ParsedEffect) else None
    return isinstance(driver, SettlingDriver) and driver.time_constant_s is None


@dataclass(frozen=True)
class Added:
    """An added effect in a context: ``size`` coefficients, then the logarithm of a time constant if searched."""

    effect: Effect
    context: Context
    size: int
    searched: bool
    fixed: Basis | None

    @property
    def unknowns(self) -> int:
        """How many common unknowns the effect has."""
        return self.size + int(self.searched)

    def names(self) -> tuple[str, ...]:
        """Names of its unknowns; the time constant's ends in ``.tau``."""
        tau = (f"{self.effect.text}.tau",) if self.searched else ()
        return (*self.effect.parameters(self.context), *tau)

    def basis(self, unknowns: Array) -> Basis:
        """The effect at its unknowns."""
        return self.fixed if self.fixed is not None else self._at(float(unknowns[-1]))

    def _at(self, logarithm: float) -> Basis:
        tau = float(np.exp(np.clip(logarithm, np.log(SHORTEST_S), np.log(LONGEST_S))))
        assert isinstance(self.effect, ParsedEffect)
        return with_time_constant(self.effect, tau).basis(self.context)

    def displacement(self, unknowns: Array, by_error: Array) -> Array:
        """Derivatives (n, 3, unknowns) of the tip-to-target vector."""
        by_coefficient = self.basis(unknowns).displacement(by_error)
        if not self.searched:
            return by_coefficient
        high = self._at(float(unknowns[-1]) + STEP).displacement(by_error)
        low = self._at(float(unknowns[-1]) - STEP).displacement(by_error)
        slope = (high - low) @ unknowns[:-1] / (2.0 * STEP)
        return np.concatenate([by_coefficient, slope[..., None]], axis=-1)


def added_in(effects: Sequence[Effect], context: Context) -> tuple[Added, ...]:
    """The added effects of a model in a context."""
    added = []
    for effect in effects:
        searched = is_searched(effect)
        fixed = None if searched else effect.basis(context)
        added.append(Added(effect, context, len(effect.parameters(context)), searched, fixed))
    return tuple(added)


def columns_of(sizes: Iterable[int]) -> tuple[slice, ...]:
    """Where groups of unknowns of these sizes stand in a vector that holds them one after the other."""
    ends = list(accumulate(sizes, initial=0))
    return tuple(slice(start, stop) for start, stop in pairwise(ends))


def resolved(added: Sequence[Added], common: Array) -> tuple[tuple[Effect, ...], Array]:
    """The same effects with their time constants fixed at ``common`` (c,), and the coefficients alone."""
    effects: list[Effect] = []
    coefficients: list[Array] = []
    for term, columns in zip(added, columns_of(term.unknowns for term in added), strict=True):
        unknowns = common[columns]
        coefficients.append(unknowns[: term.size])
        if term.searched:
            assert isinstance(term.effect, ParsedEffect)
            effects.append(with_time_constant(term.effect, float(np.exp(unknowns[-1]))))
        else:
            effects.append(term.effect)
    return tuple(effects), np.concatenate([np.zeros(0), *coefficients])
