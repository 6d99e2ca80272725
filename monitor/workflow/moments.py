"""Moments of requests: with their offset from UTC, or by the clock of the shop, as the runs of the machine had it."""

from __future__ import annotations

from datetime import datetime, timezone
from typing import overload

from monitor.exceptions import InputError
from monitor.store import Database, list_campaigns, list_runs


def check_period(since: datetime | None, until: datetime | None) -> None:
    """Raise InputError for a period that is empty; of two moments by different clocks it shows once both have one."""
    if since is None or until is None or (since.tzinfo is None) != (until.tzinfo is None):
        return
    if since >= until:
        raise InputError(
            f"the period from {since:%Y-%m-%d} to {until:%Y-%m-%d} is empty; begin it before its end"
        )


@overload
def at_machine(db: Database, machine: str, moment: datetime) -> datetime: ...


@overload
def at_machine(db: Database, machine: str, moment: None) -> None: ...


def at_machine(db: Database, machine: str, moment: datetime | None) -> datetime | None:
    """Return a moment with its offset from UTC (None stays None): one without is a time by the clock of the shop, as
    the run of the machine that is nearest to it had it.

    Raises NotFoundError for a machine that is not there, InputError where it has no run.
    """
    if moment is None or moment.tzinfo is not None:
        return moment
    measured = [
        (row.first_run_at, row.last_run_at, row.campaign)
        for row in list_campaigns(db, machine=machine)
        if row.first_run_at is not None and row.last_run_at is not None
    ]
    if not measured:
        raise InputError(
            f"{moment.isoformat()} has no offset from UTC, and machine {machine} no run whose clock would say it; "
            f"write for example {moment.isoformat()}+01:00"
        )
    _, _, campaign = min(measured, key=lambda run: max(run[0] - moment, moment - run[1]))
    nearest = min(list_runs(db, campaign), key=lambda run: abs(run.started_at - moment))
    return moment.replace(tzinfo=timezone(nearest.started_at_local - nearest.started_at))
