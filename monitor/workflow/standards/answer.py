"""The answer of `standards`: the figures of every test, each with its symbol, unit, value and standard uncertainty."""

from __future__ import annotations

from dataclasses import dataclass, field

from monitor.documents import OMITTED, Said


@dataclass(frozen=True)
class StandardFigure:
    """One figure: ``symbol`` and ``name`` as the ``standard`` has them; ``value`` and standard uncertainty ``u`` in
    ``unit``, NaN where the test cannot give it."""

    symbol: str
    name: str
    standard: str
    value: float
    u: float
    unit: str


@dataclass(frozen=True)
class TargetFigures:
    """One target of a test of positioning: means, standard deviations and numbers of runs in both directions."""

    position: float
    mean_forward: float
    mean_backward: float
    s_forward: float
    s_backward: float
    reversal: float
    runs_forward: int
    runs_backward: int


@dataclass(frozen=True)
class StandardTest:
    """A test in one ``setup`` and ``run``: ``test`` says which (positioning, diagonal, circle,
    rotation) and ``of`` the axes; two setups, with a comma between, make one of tilt.

    ``targets`` are those of a test of positioning, positions in mm or degrees, all else in ``unit``; ``notes`` say what
    the standard asks for and the plan lacks.
    """

    setup: str
    run: int
    test: str
    of: str
    unit: str
    figures: tuple[StandardFigure, ...]
    targets: tuple[TargetFigures, ...]
    notes: tuple[Said, ...]


@dataclass(frozen=True)
class StandardsAnswer:
    """All tests of a campaign; ``left_out`` are setups that no standard here evaluates, ``files`` what was written.

    ``copied_readings`` says which runs of the campaign equal those of another, and which rows of a run earlier ones.
    """

    campaign: str
    seed: int
    tests: tuple[StandardTest, ...]
    left_out: tuple[str, ...]
    files: tuple[str, ...]
    copied_readings: tuple[Said, ...] | None = field(default=None, metadata=OMITTED)
