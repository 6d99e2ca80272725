"""The request of `standards`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from monitor.exceptions import InputError


@dataclass(frozen=True)
class StandardsRequest:
    """The figures of the standards for a campaign, or for one setup of it; drawn into the folder ``figures``, written
    as CSV to ``csv``. ``seed`` is that of the draws of the uncertainties."""

    campaign: str
    setup: str | None = None
    figures: Path | None = None
    csv: Path | None = None
    seed: int = 1

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise InputError(f"--seed {self.seed}: a seed is a whole number from 0 on")
