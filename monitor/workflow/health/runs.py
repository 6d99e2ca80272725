"""The runs of a machine up to the end of a week, and those of the campaign that its page is about."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from monitor.reporting.run_notes import LeftOutNoted
from monitor.store import RecordedRun
from monitor.workflow.health.weeks import Week
from monitor.workflow.history.runs import possible_campaigns


@dataclass(frozen=True)
class Span:
    """The runs of a campaign up to the week's end: their local ``starts`` by number, in the order of time.

    ``later`` began after it; ``before`` is then the week's end, else None: the campaign is whole.
    """

    starts: Mapping[int, datetime]
    later: int
    before: datetime | None

    @property
    def first(self) -> datetime:
        """The local start of the first of them."""
        return min(self.starts.values())


def past_runs(
    runs: Sequence[RecordedRun], week: Week, campaigns: tuple[str, ...]
) -> tuple[list[RecordedRun], list[LeftOutNoted]]:
    """The runs up to the end of the week, in the order of time, and remarks on campaigns that were left out."""
    possible, remarks = possible_campaigns(runs, campaigns)
    return [run for run in runs if run.campaign in possible and run.local_start < week.ends], remarks


def first_run(runs: Sequence[RecordedRun], campaigns: tuple[str, ...]) -> RecordedRun | None:
    """The first run of a machine in the named campaigns (empty: all), of any week."""
    return next((run for run in runs if not campaigns or run.campaign in campaigns), None)


def campaign_span(runs: Sequence[RecordedRun], campaign: str, week: Week) -> Span:
    """The runs of a campaign up to the week's end, of which there is at least one."""
    starts = {run.run: run.local_start for run in runs if run.campaign == campaign}
    before = {run: start for run, start in starts.items() if start < week.ends}
    later = len(starts) - len(before)
    return Span(before, later, week.ends if later else None)
