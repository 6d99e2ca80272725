"""An effect that may be missing, as the data see it.

A candidate is an effect with the whitened change of the residual that each of its coefficients causes, everything
that the model leaves free taken out. What remains is all that the evidence rests on; where nothing remains, the data
are blind to the effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from monitor.methods.chain.least_squares import COMMON_RANK_TOLERANCE
from monitor.records import Array

# Directions of an effect of which less than this part remains hold rounding and products of small errors; a fit
# leaves them out too.
SMALLEST_SHARE = COMMON_RANK_TOLERANCE

Effect = TypeVar("Effect", covariant=True)


@dataclass(frozen=True)
class Variant(Generic[Effect]):
    """An effect to be looked at. ``family`` is how it is written; ``tries`` variants of it are searched; ``odds`` are
    those against it beforehand, where a simpler effect would do; ``nearest`` is how the catalogue comes closest to an
    effect whose shape it does not have."""

    family: str
    effect: Effect
    tries: int = 1
    odds: float = 1.0
    nearest: str | None = None


@dataclass(frozen=True)
class Candidate(Generic[Effect]):
    """An effect as the data see it.

    ``columns`` (M, k) are whitened, the model taken out, M rows; ``share`` is the part that remains; ``largest`` the
    coefficients that are likely at most, in internal units, infinite where nothing limits them.
    """

    variant: Variant[Effect]
    columns: Array
    share: float
    largest: float

    @property
    def family(self) -> str:
        """The effect as written."""
        return self.variant.family

    @property
    def effect(self) -> Effect:
        """The effect itself."""
        return self.variant.effect

    @cached_property
    def gram(self) -> Array:
        """The products (k, k) of the columns with each other."""
        return self.columns.T @ self.columns

    @property
    def behind(self) -> float:
        """By how much its score stands behind that of a likelier cause which does the same; far less than data
        decide."""
        return 0.0

    @property
    def visible(self) -> bool:
        """Whether the data see anything of the effect."""
        return self.share > SMALLEST_SHARE


def side_by_side(count: int, candidates: Sequence[Candidate[object]]) -> Array:
    """The columns (M, c) of candidates over so many rows, none where there is no candidate."""
    return np.concatenate([np.empty((count, 0)), *(candidate.columns for candidate in candidates)], axis=1)
