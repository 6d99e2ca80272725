"""The past of a machine as a health report needs it: its runs and events up to the week's end."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np

from monitor.exceptions import NotFoundError
from monitor.store import Database
from monitor.workflow.health.weeks import Week


@dataclass(frozen=True)
class PastRun:
    """A run with its local start and its conditions."""

    campaign: str
    run: int
    at: datetime
    warm_up: bool
    conditions: dict[str, float]


@dataclass(frozen=True)
class Event:
    """What people recorded."""

    at: datetime
    kind: str
    what: str


@dataclass(frozen=True)
class Span:
    """The runs of a campaign up to the week's end: how many, the local starts of the first and the last of them.

    ``later`` began after it; ``before`` is then the week's end, else None: the campaign is whole.
    """

    count: int
    first: datetime
    last: datetime
    later: int
    before: datetime | None


def past_runs(
    db: Database, machine: str, week: Week, campaigns: tuple[str, ...]
) -> tuple[list[PastRun], list[str]]:
    """Runs of a machine up to the end of the week, in the order of time, and remarks on campaigns left out.

    One machine cannot make two campaigns at a time: where runs of one lie within the span of another, only the
    campaign imported first counts, unless ``campaigns`` names others. Raises NotFoundError for such a name.
    """
    spans = db.rows(
        "SELECT campaign, min(started_at), max(started_at), any_value(campaign_id) AS number "
        "FROM v_runs JOIN v_campaigns USING (campaign, machine) WHERE machine = ? GROUP BY campaign ORDER BY number",
        [machine],
    )
    known = {campaign: (first, last) for campaign, first, last, _ in spans}
    chosen = [name for name in campaigns if name in known] if campaigns else list(known)
    kept: list[str] = []
    remarks = []
    for name in chosen:
        first, last = known[name]
        other = next((one for one in kept if known[one][0] <= last and first <= known[one][1]), None)
        if other is None:
            kept.append(name)
        else:
            remarks.append(
                f"campaign {name} was left out: its runs lie within the time of {other}, which was imported first"
            )
    rows = db.rows(
        "SELECT campaign, run, started_at_local, warm_up, map_keys(conditions), map_values(conditions) FROM v_runs "
        "WHERE machine = ? AND started_at_local < ? ORDER BY started_at, campaign, run",
        [machine, week.ends],
    )
    runs = [
        PastRun(
            campaign, run, at, warm_up, {k: v for k, v in zip(names, values, strict=True) if v is not None}
        )
        for campaign, run, at, warm_up, names, values in rows
        if campaign in kept
    ]
    return runs, remarks


def check_campaigns(db: Database, campaigns: tuple[str, ...]) -> None:
    """Raise NotFoundError for a campaign that is not there."""
    known = [str(name) for (name,) in db.rows("SELECT campaign FROM campaign ORDER BY campaign")]
    for name in campaigns:
        if name not in known:
            raise NotFoundError(f"there is no campaign '{name}'; there are {', '.join(known[:20])}")


def makers(db: Database, campaigns: tuple[str, ...]) -> set[str] | None:
    """The machines that the chosen campaigns are of; None where none is chosen: all machines count then."""
    if not campaigns:
        return None
    rows = db.rows("SELECT campaign, machine FROM v_campaigns")
    return {str(machine) for campaign, machine in rows if campaign in campaigns}


def first_run(db: Database, machine: str, campaigns: tuple[str, ...]) -> tuple[datetime, str] | None:
    """Local start and campaign of the first run of a machine in the chosen campaigns (empty: all), of any week."""
    rows = db.rows(
        "SELECT started_at_local, campaign FROM v_runs WHERE machine = ? ORDER BY started_at, campaign",
        [machine],
    )
    return next(((at, name) for at, name in rows if not campaigns or name in campaigns), None)


def campaign_span(db: Database, campaign: str, week: Week) -> Span:
    """The runs of a campaign up to the week's end, of which there is at least one."""
    ((count, first, last, later),) = db.rows(
        "SELECT count(*) FILTER (started_at_local < $ends), min(started_at_local), "
        "max(started_at_local) FILTER (started_at_local < $ends), count(*) FILTER (started_at_local >= $ends) "
        "FROM v_runs WHERE campaign = $campaign",
        {"campaign": campaign, "ends": week.ends},
    )
    return Span(int(count), first, last, int(later), week.ends if later else None)


def past_events(db: Database, machine: str, week: Week) -> list[Event]:
    """Events of a machine up to the end of the week."""
    rows = db.rows(
        "SELECT happened_at_local, kind, description FROM v_events WHERE machine = ? AND happened_at_local < ? "
        "ORDER BY happened_at",
        [machine, week.ends],
    )
    return [Event(at, kind, what) for at, kind, what in rows]


def plain(value: Any) -> float | None:
    """A number, None where there is none."""
    return None if value is None or not np.isfinite(value) else float(value)
