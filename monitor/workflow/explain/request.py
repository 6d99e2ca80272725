"""Requests of `compare`, `explain` and `model history`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from monitor.exceptions import InputError

#: False discovery rate of a search for missing effects.
RATE = 0.01


@dataclass(frozen=True)
class CompareRequest:
    """Compare a model (the method's own with None) with a campaign; figures are drawn into the folder ``figures``."""

    campaign: str
    model: str | None = None
    figures: Path | None = None


@dataclass(frozen=True)
class ExplainRequest:
    """Search for the effects that a model lacks, at the false discovery ``rate``.

    Raises InputError for a rate that does not lie between 0 and 1.
    """

    campaign: str
    model: str | None = None
    rate: float = RATE
    figures: Path | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.rate < 1.0:
            raise InputError(f"the false discovery rate must lie between 0 and 1, not {self.rate}")


@dataclass(frozen=True)
class HistoryRequest:
    """Fit every version of a model to a campaign; with None to that on which the model was last used."""

    model: str
    campaign: str | None = None
    figures: Path | None = None
