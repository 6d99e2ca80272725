"""The rules that decide on a finding of the scan beside its evidence; by default nothing is refused."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Generic

import numpy as np
import numpy.typing as npt

from monitor.discovery.search.evidence import Evidence, Pool
from monitor.discovery.search.memory import Memory
from monitor.discovery.search.scene import CandidateT, Scene


class Acceptance(Generic[CandidateT]):
    """The particular rules of a search; a search without any of its own uses this class itself."""

    def __init__(self, scene: Scene[CandidateT]) -> None:
        self.scene = scene
        self._errors: Memory[tuple[float | None, ...]] = Memory()

    def predicts(self, others: Sequence[CandidateT], candidate: CandidateT) -> bool:
        """Whether a candidate beside others lowers every error on what was left out; true where too little can be."""
        columns = self.scene.columns(others)
        errors = self.scene.held_out_errors
        before = self._errors.answer(others, None, lambda: tuple(error(columns) for error in errors))
        more = np.concatenate([columns, candidate.columns], axis=1)
        return all(
            without is None or (after := error(more)) is None or after < without
            for without, error in zip(before, errors, strict=True)
        )

    def alternatives(self, candidate: CandidateT) -> Sequence[CandidateT]:
        """Further candidates to compare with one that was found (its drivers)."""
        return ()

    def accepts(self, others: Sequence[CandidateT], candidate: CandidateT) -> bool:
        """Whether a candidate that stands out is believed beside others."""
        return True

    def error_of(self, candidate: CandidateT) -> str:
        """What a candidate is a shape of."""
        return candidate.family

    def is_credible(self, others: Sequence[CandidateT], candidate: CandidateT) -> bool:
        """Whether a candidate would be believed beside others if the error on what was left out did not say no: other
        effects that are still to be found may be what raises that."""
        return self.accepts(others, candidate)

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
        self, selected: Sequence[CandidateT], candidates: Sequence[CandidateT]
    ) -> npt.NDArray[np.bool_] | None:
        """Which candidates (n,) the data can separate from the selected ones (a period from another); None: all."""
        return None

    def outdoes(self, selected: Sequence[CandidateT], rival: CandidateT) -> bool:
        """Whether a rival with better evidence may replace one of the selected candidates."""
        return True
