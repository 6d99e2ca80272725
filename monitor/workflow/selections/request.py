"""The questions about selections of runs, and their answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from monitor.documents import OMITTED
from monitor.exceptions import InputError
from monitor.store import SelectionRow


@dataclass(frozen=True)
class SelectionRequest:
    """The runs of a ``campaign`` that meet the condition ``where``, to be named ``name``."""

    campaign: str
    name: str
    where: str


@dataclass(frozen=True)
class SelectionAnswer:
    """A selection as it was stored."""

    selection: str
    campaign: str
    condition: str
    runs: tuple[int, ...]


@dataclass(frozen=True)
class SelectionsRequest:
    """The selections of a ``campaign``, or of all."""

    campaign: str | None = None


@dataclass(frozen=True)
class SelectionsAnswer:
    """The stored selections."""

    selections: tuple[SelectionRow, ...]


@dataclass(frozen=True)
class SideBySideRequest:
    """Several selections or campaigns ``names``, compared under a ``model`` with coverage probability ``p``.

    Raises InputError for fewer than two names.
    """

    names: tuple[str, ...]
    model: str | None = None
    p: float = 0.95
    figures: Path | None = None

    def __post_init__(self) -> None:
        if len(set(self.names)) < 2:
            raise InputError("name at least two selections or campaigns to set side by side")


@dataclass(frozen=True)
class SelectionScatter:
    """Scatter of the ``runs`` of a selection, and the uncertainty of a calibration whose readings scatter so.

    ``condition`` is None for a whole campaign. Numbers by parameter, in its display unit; ``refers_to`` says in words
    what a parameter is stated relative to.
    """

    campaign: str
    condition: str | None
    runs: int
    input_covariance: str
    k_q: float
    k_q_with_degrees_of_freedom: float | None
    degrees_of_freedom: float | None
    units: Mapping[str, str]
    mean: Mapping[str, float]
    u_all: Mapping[str, float]
    u: Mapping[str, float]
    expanded: Mapping[str, float]
    refers_to: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class SideBySideAnswer:
    """The selections side by side, by name, with coverage probability ``p``."""

    p: float
    selections: Mapping[str, SelectionScatter]
    figures: tuple[str, ...] | None = field(default=None, metadata=OMITTED)

    @property
    def units(self) -> dict[str, str]:
        """The display unit of every parameter of any selection."""
        return {name: unit for scatter in self.selections.values() for name, unit in scatter.units.items()}

    @property
    def refers_to(self) -> dict[str, str]:
        """What every parameter refers to; of selections of machines whose chains differ all that occur."""
        said: dict[str, set[str]] = {}
        for scatter in self.selections.values():
            for name, frame in scatter.refers_to.items():
                said.setdefault(name, set()).add(frame)
        return {name: " or ".join(sorted(frames)) for name, frames in said.items()}
