"""What the weekly report rests on, computed and stored when a campaign comes in and not when the report is asked for.

Identification, uncertainty, comparison and map of a machine take three quarters of the time of a report that has all of
them to compute. A report that finds them stored says the same.
"""

from __future__ import annotations

from collections.abc import Collection
from datetime import date

from monitor.exceptions import InputError, StoreError
from monitor.store import Database, campaign_machines, machine_runs
from monitor.workflow.health.machine import MachineName, named_machines, read_week
from monitor.workflow.health.request import ReportOptions
from monitor.workflow.health.results import stored_with
from monitor.workflow.health.task import computed
from monitor.workflow.health.weeks import week_of


def compute_ahead(db: Database, campaigns: Collection[str], today: date) -> tuple[str, ...]:
    """Compute and store what the report of the week of their last run asks of the machines of ``campaigns``.

    Returns the machines for which everything is stored. Where something fails the machine is left out and nothing is
    raised: the report tries again, and its page says why. Raises StoreError where the database cannot be used.
    """
    machine_of = campaign_machines(db)
    machines = {machine_of[name] for name in campaigns if name in machine_of}
    return tuple(
        name.machine
        for name in named_machines(db)
        if name.machine in machines and _is_stored(db, name, today)
    )


def _is_stored(db: Database, name: MachineName, today: date) -> bool:
    """Whether everything about the week of the last run of a machine is stored, once what lacks is computed."""
    runs = machine_runs(db, name.machine)
    if not runs or (week := week_of(runs[-1].local_start.date())).first > today:
        return False
    try:
        past = read_week(db, name, week, ReportOptions())
    except StoreError:
        raise
    except InputError:
        return False
    if past.measured is None or past.results is None:
        return False
    _, failures = stored_with(db, past.results, computed(past.task), past.measured)
    return not failures
