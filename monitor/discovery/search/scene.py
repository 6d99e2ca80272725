"""The protocol of data that can be searched for missing effects: a residual, and candidates that may explain it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from monitor.discovery.search.candidate import Candidate
from monitor.discovery.search.remainder import Remainders
from monitor.records import Array

CandidateT = TypeVar("CandidateT", bound=Candidate[object])
CandidateT_co = TypeVar("CandidateT_co", bound=Candidate[object], covariant=True)


class Scene(Protocol[CandidateT_co]):
    """The residual of a fitted model, and the candidates that may explain it; M rows."""

    @property
    def residual(self) -> Array:
        """The whitened residual (M,)."""

    @property
    def degrees_of_freedom(self) -> int:
        """Those of the residual before the columns of shared effects are taken out."""

    @property
    def candidates(self) -> tuple[CandidateT_co, ...]:
        """Everything that may be missing."""

    def columns(self, candidates: Sequence[Candidate[object]]) -> Array:
        """The columns (M, c) of effects that the model shares between runs, then those of the candidates."""

    @property
    def remainders(self) -> Remainders:
        """What selected effects, beside those that the model shares, leave of the residual."""

    @property
    def held_out_errors(self) -> tuple[Callable[[Array], float | None], ...]:
        """Root mean square errors with columns (M, c) of shared effects on what took no part in their fit, one for
        every way to leave out (rows, runs, poses); None where too few can be left out."""


def family_count(scene: Scene[Candidate[object]]) -> int:
    """The number of families of which the data see anything."""
    return len({candidate.family for candidate in scene.candidates if candidate.visible})
