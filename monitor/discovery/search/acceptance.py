"""The rules that decide on a finding of the scan beside its evidence; by default nothing is refused."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Generic

import numpy as np

from monitor.discovery.search.candidate import Candidate
from monitor.discovery.search.evidence import Evidence, Pool
from monitor.discovery.search.scene import CandidateT, Scene


class Acceptance(Generic[CandidateT]):
    """The particular rules of a search; a search without any of its own uses this class itself."""

    def alternatives(self, candidate: CandidateT) -> Sequence[CandidateT]:
        """Further candidates to compare with one that was found (its drivers)."""
        return ()

    def accepts(self, others: Sequence[CandidateT], candidate: CandidateT) -> bool:
        """Whether a candidate that stands out is believed beside others."""
        return True

    def stands_among(
        self, pool: Pool[CandidateT], others: Sequence[CandidateT], evidence: Evidence[CandidateT]
    ) -> bool:
        """Whether noise would seldom bring forth a candidate of a pool beside others that is as convincing as this."""
        return True

    def at_best_value(self, selected: Sequence[CandidateT], index: int) -> CandidateT:
        """The selected candidate at an index with its time constant or period at the best value, so that what the grid
        misses is not mistaken for another effect."""
        return selected[index]

    def separable(
        self, selected: Sequence[CandidateT], weighed: list[Evidence[CandidateT]]
    ) -> list[Evidence[CandidateT]]:
        """Evidence for those candidates that the data can separate from the selected ones (a period from another)."""
        return weighed

    def outdoes(self, selected: Sequence[CandidateT], rival: CandidateT) -> bool:
        """Whether a rival with better evidence may replace one of the selected candidates."""
        return True


def lowers_held_out_error(
    scene: Scene[Candidate[object]], others: Sequence[Candidate[object]], candidate: Candidate[object]
) -> bool:
    """Whether a candidate beside others lowers the error on rows left out; true where too few can be left out."""
    columns = scene.columns(others)
    before = scene.held_out_error(columns)
    after = scene.held_out_error(np.concatenate([columns, candidate.columns], axis=1))
    return before is None or after is None or after < before
