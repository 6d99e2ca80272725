"""What selected effects leave of a residual, computed once for each set of them.

A search asks the same again and again: beside these effects, what do those say? The span of the selected ones is the
costly part of the answer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from monitor.discovery.search.candidate import Candidate
from monitor.discovery.search.projection import orthonormal_by, without
from monitor.records import Array

# So many numbers of bases are remembered, 64 MB: 200 sets of ten effects on 4 000 readings.
MOST_NUMBERS = 8_000_000


@dataclass(frozen=True)
class Remainder:
    """The residual (M,) without the span of the ``selected`` effects and of those that the model shares, an orthonormal
    ``basis`` (M, r) of that span, and the degrees of freedom that it leaves.

    The basis consists of ``combinations`` (c, r) of the ``shared`` columns and of those of the selected ones, in their
    order; ``whole`` (M,) is the residual before.
    """

    selected: tuple[Candidate[object], ...]
    shared: Array
    combinations: Array
    whole: Array
    basis: Array
    residual: Array
    degrees_of_freedom: int


class Remainders:
    """What sets of effects leave of a residual (M,), whatever their order; ``columns`` gives the columns (M, c) of a
    set and of what the model shares. The sets asked for last are remembered, as far as there is room."""

    def __init__(
        self,
        residual: Array,
        degrees_of_freedom: int,
        columns: Callable[[Sequence[Candidate[object]]], Array],
    ) -> None:
        self._residual = residual
        self._degrees_of_freedom = degrees_of_freedom
        self._columns = columns
        self._shared = columns([])
        self._remembered: dict[frozenset[int], Remainder] = {}
        self._numbers = 0

    def beside(self, selected: Sequence[Candidate[object]]) -> Remainder:
        """What selected effects leave."""
        # The candidates stay in the remainder: an identity is only that of an object that exists.
        key = frozenset(id(candidate) for candidate in selected)
        remainder = self._remembered.pop(key, None)
        if remainder is None:
            basis, combinations = orthonormal_by(self._columns(selected))
            residual = without(basis, self._residual[:, None])[:, 0]
            freedom = self._degrees_of_freedom - basis.shape[1]
            remainder = Remainder(
                tuple(selected), self._shared, combinations, self._residual, basis, residual, freedom
            )
            self._numbers += basis.size
        self._remembered[key] = remainder
        while self._numbers > MOST_NUMBERS and len(self._remembered) > 1:
            oldest = self._remembered.pop(next(iter(self._remembered)))
            self._numbers -= oldest.basis.size
        return remainder
