"""Which runs of a machine its history is made of, and which campaigns cannot both be true."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import TYPE_CHECKING

import numpy as np

from monitor.exceptions import NotFoundError, did_you_mean
from monitor.store import MachineHistory, RecordedRun

if TYPE_CHECKING:
    from monitor.reporting.run_notes import LeftOutNoted, SameHoursNoted


def selected_campaigns(history: MachineHistory, campaigns: tuple[str, ...]) -> MachineHistory:
    """The runs of the named campaigns (empty: all). Raises NotFoundError for one that the history does not hold."""
    present = list(dict.fromkeys(history.campaign.tolist()))
    for name in campaigns:
        if present and name not in present:
            raise NotFoundError(
                f"the history of machine {history.machine} holds no campaign {name!r}; "
                f"{did_you_mean(name, present)}it holds {', '.join(present)}"
            )
    return history.part(np.isin(history.campaign, campaigns)) if campaigns else history


def only_runs(history: MachineHistory, runs: Sequence[RecordedRun]) -> MachineHistory:
    """The identified ones of some runs."""
    selected = {(run.campaign, run.run) for run in runs}
    pairs = zip(history.campaign.tolist(), history.run.tolist(), strict=True)
    return history.part(np.array([pair in selected for pair in pairs], dtype=np.bool_))


def same_hours(history: MachineHistory) -> list[SameHoursNoted]:
    """A sentence for every group of campaigns that hold runs of the same hours, which one machine cannot have made.

    The runs of a campaign's day stretch from its first start to its last; two campaigns that take turns within a
    day do overlap, two that follow each other on one day do not.
    """
    days: dict[tuple[str, int], list[float]] = {}
    for name, day, at in zip(
        history.campaign.tolist(), history.day.tolist(), history.seconds.tolist(), strict=True
    ):
        days.setdefault((name, day), []).append(at)
    groups = overlapping((min(at), max(at), name) for (name, _), at in days.items())
    if not groups:
        return []
    from monitor.reporting.run_notes import SameHoursNoted

    return [SameHoursNoted(names) for names in groups]


def overlapping(days: Iterable[tuple[float, float, str]]) -> list[tuple[str, ...]]:
    """Return the groups of campaigns of which days overlap, each in the order of names; a day is first start, last
    start, campaign."""
    stretches = sorted(days)
    group = {name: {name} for _, _, name in stretches}
    # In the order of their beginnings, a stretch overlaps an earlier one where it begins before the latest end.
    latest, holder = -np.inf, ""
    for begins, ends, name in stretches:
        if begins <= latest and name != holder:
            joined = group[holder] | group[name]
            for member in joined:
                group[member] = joined
        if ends > latest:
            latest, holder = ends, name
    return sorted({tuple(sorted(names)) for names in group.values() if len(names) > 1})


def possible_campaigns(
    runs: Sequence[RecordedRun], campaigns: tuple[str, ...]
) -> tuple[set[str], list[LeftOutNoted]]:
    """The campaigns that one machine can have made, and a remark on each that was left out.

    Where runs of a campaign lie within the span of another, only the one imported first counts, unless ``campaigns``
    names others.
    """
    numbers = {run.campaign: run.campaign_id for run in runs}
    starts: dict[str, list[datetime]] = {}
    for run in runs:
        starts.setdefault(run.campaign, []).append(run.started_at)
    spans = {name: (min(at), max(at)) for name, at in starts.items()}
    candidates = (
        [name for name in campaigns if name in spans]
        if campaigns
        else sorted(numbers, key=numbers.__getitem__)
    )
    selected: list[str] = []
    remarks = []
    for name in candidates:
        first, last = spans[name]
        overlapped = next(
            (other for other in selected if spans[other][0] <= last and first <= spans[other][1]), None
        )
        if overlapped is None:
            selected.append(name)
        else:
            from monitor.reporting.run_notes import LeftOutNoted

            remarks.append(LeftOutNoted(name, overlapped))
    return set(selected), remarks
