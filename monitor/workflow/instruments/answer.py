"""The answer of `contributions`: parts of each u, what each instrument says alone, and E_n between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from monitor.documents import OMITTED, Said
from monitor.methods.method import ContrastKind


@dataclass(frozen=True)
class InstrumentFit:
    """An instrument with its setups: numbers read, and what the joint fit leaves of them, root mean square in standard
    uncertainties (1 is expected, less where the instrument has unknowns of its own)."""

    instrument: str
    setups: tuple[str, ...]
    numbers: int
    rms_in_u: float


@dataclass(frozen=True)
class AloneValue:
    """What the readings of one instrument say of a parameter by themselves; ``u`` is by their own scatter, with its
    ``degrees_of_freedom``, where that is more than stated."""

    instrument: str
    value: float
    u: float
    degrees_of_freedom: float | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class Agreement:
    """Two instruments that both determine a parameter: E_n (ISO 13528:2022, 9.7) with U = 2 u; above 1 they
    disagree. ``degrees_of_freedom`` are those of its u where one of them scatters more than it states."""

    first: str
    second: str
    e_n: float
    degrees_of_freedom: float | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class Disagreement:
    """The E_n that is the least by chance of so many ``comparisons`` between the instruments of a ``run``: chance alone
    makes one as large in no more than ``by_chance`` of campaigns without fault (Bonferroni's bound)."""

    run: int
    parameter: str
    first: str
    second: str
    e_n: float
    comparisons: int
    by_chance: float
    degrees_of_freedom: float | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class Suspect:
    """One of a ``kind`` (a setup, an instrument, a stated number that several ``setups`` share) without which nothing
    contradicts any more: the others agree (``others_agree``), or share nothing that could contradict."""

    name: str
    kind: ContrastKind
    setups: tuple[str, ...]
    others_agree: bool

    @property
    def is_stated(self) -> bool:
        """Whether it is a stated number, of which nothing was read."""
        return self.kind is ContrastKind.STATED


@dataclass(frozen=True)
class AgainstOthers:
    """One of a ``kind`` (a setup, an instrument, a stated number that several setups share) that contradicts all others
    of a ``run`` together; of those that are suspects the least likely, of all where there is none.

    They can differ in so many ``directions`` and do by ``size`` (root of the mean square in standard uncertainties;
    ``limit`` is what chance exceeds as often as is doubtful), the least likely of so many ``comparisons``; chance alone
    makes as much in no more than ``by_chance`` of campaigns without fault (Bonferroni's bound). ``suspects`` are those
    that explain it alone: without each of them nothing contradicts any more. None where no single one explains it.
    """

    run: int
    name: str
    kind: ContrastKind
    setups: tuple[str, ...]
    directions: int
    size: float
    limit: float
    comparisons: int
    by_chance: float
    suspects: tuple[Suspect, ...]

    @property
    def is_of_two(self) -> bool:
        """Whether two contradict each other and there is nobody else: each contradicts as much as the other."""
        return self.comparisons == 1 and len(self.suspects) == 2


@dataclass(frozen=True)
class RunsWithTime:
    """A ``number`` of a ``setup`` that runs off with the time, by ``size`` from its first row of a ``run`` to its last,
    beside what the model says, with standard uncertainty ``u``, both in ``unit``; chance alone makes one as large among
    so many ``comparisons`` in no more than ``by_chance`` of campaigns without fault (Bonferroni's bound)."""

    run: int
    setup: str
    number: str
    unit: str
    size: float
    u: float
    comparisons: int
    by_chance: float


@dataclass(frozen=True)
class ParameterShares:
    """A parameter of the joint fit: ``parts`` are what each instrument adds to u as a standard uncertainty (u² is the
    sum of their squares); ``known_beforehand`` is the part of lengths and beams that the setups state.

    ``refers_to`` says in words what an error of the chain is stated relative to.
    """

    parameter: str
    unit: str
    value: float
    u: float
    parts: Mapping[str, float]
    known_beforehand: float
    alone: tuple[AloneValue, ...]
    agreement: tuple[Agreement, ...]
    refers_to: str | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class InstrumentsAnswer:
    """The instruments of one run; ``not_determined`` are parameters that all of them together do not separate.

    ``by_chance`` is how often at most the least likely E_n of so many comparisons comes about without fault, None where
    nothing is compared. ``copied_readings`` says which runs of the campaign equal those of another, and which rows of a
    run earlier ones.
    """

    campaign: str
    run: int
    model: str
    instruments: tuple[InstrumentFit, ...]
    parameters: tuple[ParameterShares, ...]
    not_determined: tuple[str, ...]
    by_chance: float | None
    copied_readings: tuple[Said, ...] | None = field(default=None, metadata=OMITTED)
