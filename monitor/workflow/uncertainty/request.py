"""The question for the uncertainty of a run's geometric errors."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from datetime import datetime

from monitor.documents import OMITTED
from monitor.exceptions import InputError
from monitor.records import LinearAxes
from monitor.reporting.budget import HoldsFor
from monitor.sources import QUANTITIES, Source

#: Coverage probability of what is certified, and of results where no other is asked for.
COVERAGE = 0.95
#: Regions beyond these say nothing that a sample of trials could show, and take the longer the less is in them.
LEAST_COVERAGE, MOST_COVERAGE = 0.5, 0.9999
METHODS = ("guf", "mcm", "both")
#: The words of --holds-for.
HOLDS_FOR = tuple(word.value for word in HoldsFor)


def holds_for(word: str | None) -> HoldsFor | None:
    """What a word of --holds-for stands for. Raises InputError for another."""
    if word is not None and word not in HOLDS_FOR:
        raise InputError(f"--holds-for {word}: choose run, day or campaign")
    return None if word is None else HoldsFor(word)


def check_coverage(p: float) -> None:
    """Raise InputError for a coverage probability that no region is stated for."""
    if not LEAST_COVERAGE <= p <= MOST_COVERAGE:
        raise InputError(
            f"-p {p}: a coverage probability lies between {LEAST_COVERAGE} and {MOST_COVERAGE}; 0.95 is usual"
        )


#: Each source is a line of the budget, and a column of it for each parameter.
MOST_SOURCES = 200
#: An uncertainty of an uncertainty of more than twice itself (JCGM 100:2008, G.3: 1/sqrt(2 dof)) says nothing.
LEAST_DOF = 0.1


def check_source(source: Source) -> None:
    """Raise InputError for a size or degrees of freedom that the file of sources would not take."""
    size, most = source.unit.to_display(source.size), QUANTITIES[source.quantity].largest
    # A size at the limit may lie a rounding beyond it.
    if not 0.0 < size <= most * (1.0 + 1e-9):
        raise InputError(
            f"--sources {source.name}: its size is {size:g} {source.unit.name}; it lies above 0, up to {most:g}"
        )
    dof = source.degrees_of_freedom
    if dof is not None and dof < LEAST_DOF:
        raise InputError(f"--sources {source.name}: {dof:g} degrees of freedom; write {LEAST_DOF:g} or more")


@dataclass(frozen=True)
class Asked:
    """What decides the numbers of an evaluation by the GUM framework besides run and model; stored with its answer.

    Only an evaluation that was asked for the same answers a later question.
    """

    p: float = COVERAGE
    select: str | None = None
    model_uncertainty: bool = True
    linear_axes: LinearAxes | None = None
    holds_for: HoldsFor | None = field(default=None, metadata=OMITTED)
    sources: tuple[Source, ...] | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class UncertaintyRequest:
    """The uncertainty of one ``run`` of a campaign (the last by default) under a ``model`` (default: the method's own).

    ``method``: guf (GUM framework), mcm (Monte Carlo) or both, with the validation. The Monte Carlo result is stable to
    ``digits`` significant digits. ``select`` names a stored selection, or a campaign of the same plan: its runs give
    the covariance of the readings. ``model_uncertainty`` adds what lack of fit leaves. ``linear_axes`` adds what errors
    of the linear axes do, for a method that takes those axes as known. Runs that began at or after ``before`` (with an
    offset, or by the clock of the shop) take no part. The trials go to ``workers`` processes or the Dask scheduler at
    the address ``cluster``, else to threads.

    Raises InputError for a method, digits, seed or probability that cannot be.
    """

    campaign: str
    run: int | None = None
    _: KW_ONLY
    model: str | None = None
    method: str = "both"
    digits: int = 2
    seed: int = 1
    p: float = COVERAGE
    model_uncertainty: bool = True
    select: str | None = None
    before: datetime | None = None
    linear_axes: LinearAxes | None = None
    sources: tuple[Source, ...] | None = None
    holds_for: str | None = None
    workers: int | None = None
    cluster: str | None = None

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise InputError(f"--method {self.method}: choose guf, mcm or both")
        if not 1 <= self.digits <= 4:
            raise InputError(f"--digits {self.digits}: choose 1 to 4 significant digits")
        if not 0 <= self.seed < 2**63:
            raise InputError(f"--seed {self.seed}: a seed is a whole number from 0 to 9223372036854775807")
        check_coverage(self.p)
        if len(self.sources or ()) > MOST_SOURCES:
            raise InputError(f"--sources: {MOST_SOURCES} at most, not {len(self.sources or ())}")
        for source in self.sources or ():
            check_source(source)
        holds_for(self.holds_for)

    @property
    def asked(self) -> Asked:
        """The part of the question that decides the numbers of the GUM framework."""
        return Asked(
            self.p,
            self.select,
            self.model_uncertainty,
            self.linear_axes,
            holds_for(self.holds_for),
            self.sources,
        )
