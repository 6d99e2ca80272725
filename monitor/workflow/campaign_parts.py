"""Some runs of a campaign: one alone, all but some, or those that began before a moment."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from datetime import datetime

import numpy as np

from monitor.exceptions import DataError, NotFoundError
from monitor.records import Campaign, Run


def only_run(campaign: Campaign, run: int) -> Campaign:
    """A campaign with one run alone. Raises NotFoundError where there is no such run."""
    numbers = [each.run for each in campaign.runs]
    if run not in numbers:
        raise NotFoundError(
            f"campaign {campaign.name} has no run {run}; it has {', '.join(map(str, numbers))}"
        )
    return _part(campaign, lambda each: each.run == run)


def without_runs(campaign: Campaign, numbers: Collection[int]) -> Campaign:
    """A campaign without some of its runs."""
    return _part(campaign, lambda run: run.run not in numbers)


def runs_before(campaign: Campaign, moment: datetime | None) -> Campaign:
    """The runs that began before a moment (all with None): one with an offset, or a time by the clock of the shop.

    Raises DataError where there is none.
    """
    if moment is None:
        return campaign
    by_the_shop = moment.tzinfo is None
    part = _part(
        campaign,
        lambda run: (run.started_at.replace(tzinfo=None) if by_the_shop else run.started_at) < moment,
    )
    if not part.runs:
        raise DataError(f"campaign {campaign.name} has no run before {moment:%Y-%m-%d %H:%M%z}")
    return part


def _part(campaign: Campaign, belongs: Callable[[Run], bool]) -> Campaign:
    runs = tuple(run for run in campaign.runs if belongs(run))
    if len(runs) == len(campaign.runs):
        return campaign
    rows = np.isin(campaign.probings.run, [run.run for run in runs])
    return replace(campaign, runs=runs, probings=campaign.probings.rows(rows))


def kind_of(kind: str, before: datetime | None) -> str:
    """The kind under which a result is stored: a part of a campaign is never taken for the whole."""
    return kind if before is None else f"partial {kind}"


def method_of(method: str, before: datetime | None) -> str:
    """The method under which a result is stored; for a part of a campaign it names the runs."""
    return method if before is None else f"{method}, runs before {before:%Y-%m-%d %H:%M%z}"
