"""Some runs of a campaign: one alone, or those that began before a moment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime

import numpy as np

from monitor.exceptions import DataError, NotFoundError
from monitor.records import Campaign, Run


def only_run(campaign: Campaign, run: int) -> Campaign:
    """A campaign with one run alone. Raises NotFoundError where there is no such run."""
    if run not in {one.run for one in campaign.runs}:
        there = ", ".join(str(one.run) for one in campaign.runs)
        raise NotFoundError(f"campaign {campaign.name} has no run {run}; it has {there}")
    return _part(campaign, lambda one: one.run == run)


def runs_before(campaign: Campaign, moment: datetime | None) -> Campaign:
    """The runs that began before a local time without a zone (all with None): what was known by then.

    Raises DataError where there is none.
    """
    if moment is None:
        return campaign
    part = _part(campaign, lambda one: one.started_at.replace(tzinfo=None) < moment)
    if not part.runs:
        raise DataError(f"campaign {campaign.name} has no run before {moment:%Y-%m-%d %H:%M}")
    return part


def _part(campaign: Campaign, kept: Callable[[Run], bool]) -> Campaign:
    runs = tuple(one for one in campaign.runs if kept(one))
    if len(runs) == len(campaign.runs):
        return campaign
    chosen = np.isin(campaign.probings.run, [one.run for one in runs])
    return replace(campaign, runs=runs, probings=campaign.probings.rows(chosen))


def kind_of(kind: str, before: datetime | None) -> str:
    """The kind under which a result is stored: that of a part of a campaign is never taken for that of the whole."""
    return kind if before is None else f"partial {kind}"


def method_of(method: str, before: datetime | None) -> str:
    """The method under which it is stored; that of a part says which runs it was computed from."""
    return method if before is None else f"{method}, runs before {before:%Y-%m-%d %H:%M}"
