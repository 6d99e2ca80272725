"""What is asked of the weekly health report, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

from monitor.documents import OMITTED, Said, named
from monitor.exceptions import InputError
from monitor.reporting.health.answers import AnsweredQuestion
from monitor.reporting.health.records import FleetRow, RefusedImport
from monitor.reporting.weekly_notice import WeeklyNotices
from monitor.workflow.engines import check_workers
from monitor.workflow.history.beyond_limit import RISK


@dataclass(frozen=True)
class ReportOptions:
    """What the reader of a report named: the model, the campaigns (empty: all), the probability that alarms."""

    model: str | None = None
    campaigns: tuple[str, ...] = ()
    risk: float = RISK

    def __post_init__(self) -> None:
        if not 0.0 < self.risk < 1.0:
            raise InputError(f"the probability that alarms must lie between 0 and 1, not {self.risk}")


@dataclass(frozen=True)
class ReportRequest:
    """State one machine or all at the end of a week, into HTML and PDF.

    ``week`` like ``2026-W10``, by default the last that has ended at ``made_at`` (by default now). Files go to ``out``
    (made where there is none). ``workers`` processes compute, by default as many as there are cores and the fleet
    occupies, or the workers of the Dask cluster at ``cluster``; the results do not depend on it.
    """

    week: str | None = None
    machine: str | None = None
    out: Path = field(default_factory=Path)
    options: ReportOptions = field(default_factory=ReportOptions)
    workers: int | None = None
    made_at: datetime | None = None
    cluster: str | None = None

    def __post_init__(self) -> None:
        check_workers(self.workers, self.cluster)


@dataclass(frozen=True)
class ReportAnswer:
    """The machines by urgency, those that raise an alarm, and the files written.

    ``answers`` are the questions of the first page with a sentence each, such as which machine is the worst.
    ``weekly_looks`` are the notices of the week, as if the fleet had been looked at every week.
    """

    week: str
    from_: str = field(metadata=named("from"))
    to: str
    machines: tuple[FleetRow, ...]
    measured: int
    ended: bool
    alarms: tuple[str, ...]
    refused_imports: tuple[RefusedImport, ...]
    message: Said
    answers: tuple[AnsweredQuestion, ...]
    files: tuple[str, ...]
    weekly_looks: WeeklyNotices
    mailed_to: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
