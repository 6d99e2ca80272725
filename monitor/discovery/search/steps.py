"""A search step by step: propose, test, accept, and ask again what still stands, until nothing more does."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Protocol

from monitor.discovery.search.scene import CandidateT


class Steps(Protocol[CandidateT]):
    """What a search step by step asks of the thing that is searched."""

    def best(self, selected: Sequence[CandidateT], fallen: Collection[str]) -> CandidateT | None:
        """Propose the most convincing candidate that stands every test beside the selected ones, the error on what was
        left out among them; None where none does. Families that have ``fallen`` are not proposed again."""

    def admitted(self, selected: Sequence[CandidateT], best: CandidateT) -> list[CandidateT]:
        """The selected candidates with another one at its best value, and without those whose place it takes."""

    def standing(self, selected: Sequence[CandidateT]) -> list[CandidateT]:
        """The selected candidates that stand beside the others."""

    def ahead(
        self, selected: Sequence[CandidateT], fallen: Collection[str], most: int
    ) -> list[CandidateT] | None:
        """The selected candidates with several more, up to ``most``, that stand beside each other although none of them
        stands beside the selected ones alone; None where there are no such."""


def step_by_step(
    steps: Steps[CandidateT], begin: Sequence[CandidateT], *, most: int, most_steps: int
) -> list[CandidateT]:
    """Select at most so many candidates in at most so many steps, beginning with those of an earlier search."""
    selected = list(begin)
    fallen: set[str] = set()
    for _ in range(most_steps):
        best = steps.best(selected, fallen) if len(selected) < most else None
        if best is not None:
            selected = steps.admitted(selected, best)
            continue
        # What an exchange, a merger or a later effect has made doubtful is no finding; others have their turn.
        standing = steps.standing(selected)
        if len(standing) < len(selected):
            fallen |= {candidate.family for candidate in selected} - {
                candidate.family for candidate in standing
            }
            selected = standing
            continue
        together = steps.ahead(selected, fallen, most)
        if together is None:
            break
        selected = together
    return steps.standing(selected)
