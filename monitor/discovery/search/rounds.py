"""The rounds of a search: effects are searched under conditions, and the conditions are judged anew under the effects.

The conditions are what else may be the matter with the data: readings to be left out, targets that moved, noise that
neighbours share. Each can be mistaken for an effect and an effect for each, so they have their turns until nothing
changes.
"""

from __future__ import annotations

from typing import Generic, Protocol, TypeVar

from monitor.progress import told, within

#: Shares of the time of an explanation up to its rounds, up to the end of them, and of a round up to its judgement:
#: medians of nine examples (processor time). How many rounds there will be nobody knows; most searches need one or two.
BEFORE_ROUNDS, UP_TO_ROUNDS, UP_TO_JUDGEMENT = 0.06, 0.95, 0.85

RoundT = TypeVar("RoundT")
ConditionT = TypeVar("ConditionT")


class Searched(Protocol[RoundT]):
    """What a search in rounds asks of the thing that is searched, which knows its present conditions."""

    def round(self) -> RoundT:
        """Search effects under the present conditions (``steps``), and fit the model with those that were accepted."""

    def judged(self, current: RoundT) -> RoundT | None:
        """Judge the conditions under a round; return the round that stands, None where others have their turn."""


def in_rounds(searched: Searched[RoundT], most: int) -> tuple[RoundT, bool]:
    """The round that stands after at most so many; else the last one, and False.

    Whoever waits is told a share in which the present round is the last: another one takes it back.
    """
    for number in range(most):
        begun, ended = (_share(number, done) for done in (0.0, 1.0))
        told(begun)
        with within(begun, begun + UP_TO_JUDGEMENT * (ended - begun)):
            current = searched.round()
            told(1.0)
        standing = searched.judged(current)
        told(ended)
        if standing is not None:
            return standing, True
    return current, False


def _share(rounds: int, of_this: float) -> float:
    """How far an explanation is after so many rounds and a part of the present one, if that is the last."""
    return BEFORE_ROUNDS + (UP_TO_ROUNDS - BEFORE_ROUNDS) * (rounds + of_this) / (rounds + 1)


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
