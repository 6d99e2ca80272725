"""Answers about a candidate beside others, each computed once: a search that exchanges effects comes back to the same
sets of them again and again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Generic, TypeVar

from monitor.discovery.search.candidate import Candidate

AnswerT = TypeVar("AnswerT")


class Memory(Generic[AnswerT]):
    """Answers by candidate and by the others beside it, whatever their order."""

    def __init__(self) -> None:
        self._answers: dict[
            tuple[int, frozenset[int]], tuple[AnswerT, Candidate[object] | None, Sequence[Candidate[object]]]
        ] = {}

    def answer(
        self,
        others: Sequence[Candidate[object]],
        candidate: Candidate[object] | None,
        compute: Callable[[], AnswerT],
    ) -> AnswerT:
        """The answer of ``compute`` for a candidate (None: for the others alone) beside others."""
        key = (id(candidate), frozenset(id(other) for other in others))
        if key not in self._answers:
            # The candidates are kept too: an identity is only that of an object that exists.
            self._answers[key] = compute(), candidate, tuple(others)
        return self._answers[key][0]
