"""What is asked of a look at a watched folder, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from monitor.exceptions import InputError
from monitor.workflow.health.request import ReportAnswer
from monitor.workflow.intake.importing import RefusedFolder


@dataclass(frozen=True)
class WatchRequest:
    """Look once at a ``folder`` and take in what came.

    An arrival is at rest when nothing in it was written for ``rest_s`` seconds. The weekly report goes to ``reports``;
    None: no report is made. ``mail`` is the configuration by which it is told; None: nobody is written to.
    """

    folder: Path
    rest_s: float = 30.0
    reports: Path | None = None
    mail: Path | None = None

    def __post_init__(self) -> None:
        if not 0.0 <= self.rest_s <= 86400.0:
            raise InputError(f"--rest {self.rest_s:g}: seconds without a change, from 0 to 86400")
        if not self.folder.is_dir():
            raise InputError(
                f"{self.folder} is no folder; name the one that campaign folders are copied into"
            )


@dataclass(frozen=True)
class ArrivedCampaign:
    """A campaign that was imported from an arrival, or was in the database already.

    ``identified`` is False where it could not be, ``why_not`` says why; ``notes`` may be mistakes of the files.
    """

    campaign: str
    arrival: str
    state: str
    runs: int
    rows: int | None
    identified: bool
    why_not: str | None
    notes: tuple[str, ...]


@dataclass(frozen=True)
class WaitingArrival:
    """An arrival that is left for a later look, and why."""

    arrival: str
    why: str


@dataclass(frozen=True)
class WatchAnswer:
    """What came, what was refused with all its faults, what still changes, the report, and who was written to."""

    folder: str
    arrived: tuple[ArrivedCampaign, ...]
    refused: tuple[RefusedFolder, ...]
    waiting: tuple[WaitingArrival, ...]
    report: ReportAnswer | None
    mailed_to: tuple[str, ...] = ()

    @property
    def news(self) -> bool:
        """Whether there is anything to tell."""
        return bool(self.arrived or self.refused)
