"""The rounds of a search: effects are searched under conditions, and the conditions are judged anew under the effects.

The conditions are what else may be the matter with the data: readings to be left out, targets that moved, noise that
neighbours share. Each can be mistaken for an effect and an effect for each, so they have their turns until nothing
changes.
"""

from __future__ import annotations

from typing import Generic, Protocol, TypeVar

RoundT = TypeVar("RoundT")
ConditionT = TypeVar("ConditionT")


class Searched(Protocol[RoundT]):
    """What a search in rounds asks of the thing that is searched, which knows its present conditions."""

    def round(self) -> RoundT:
        """Search effects under the present conditions (``steps``), and fit the model with those that were accepted."""

    def judged(self, current: RoundT) -> RoundT | None:
        """Judge the conditions under a round; return the round that stands, None where others have their turn."""


def in_rounds(searched: Searched[RoundT], most: int) -> tuple[RoundT, bool]:
    """The round that stands after at most so many; else the last one, and False."""
    for _ in range(most):
        current = searched.round()
        standing = searched.judged(current)
        if standing is not None:
            return standing, True
    return current, False


class Turns(Generic[ConditionT, RoundT]):
    """Conditions that had their turn, with the rounds under them."""

    def __init__(self) -> None:
        self._turns: list[tuple[ConditionT, RoundT]] = []

    def circle(
        self, condition: ConditionT, current: RoundT, following: ConditionT
    ) -> list[tuple[ConditionT, RoundT]]:
        """Add the round under a condition; return all turns since the ``following`` condition that it leaves had its
        own, one where it leaves its own; empty where that has not had its turn."""
        self._turns.append((condition, current))
        conditions = [earlier for earlier, _ in self._turns]
        return self._turns[conditions.index(following) :] if following in conditions else []
