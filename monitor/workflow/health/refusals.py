"""Imports that were refused in a week: on the page of their machine, or on the first page where it is not known."""

from __future__ import annotations

from collections.abc import Collection

from monitor.reporting.health.records import RefusedImport
from monitor.store import Database, StoredRefusal, refusals
from monitor.workflow.health.weeks import Week


def refused_of(db: Database, machine: str, week: Week) -> tuple[RefusedImport, ...]:
    """What was refused of one machine in a week."""
    return tuple(_told(one) for one in refusals(db, week.begins, week.ends) if one.machine == machine)


def refused_elsewhere(db: Database, machines: Collection[str], week: Week) -> tuple[RefusedImport, ...]:
    """What was refused in a week of none of the ``machines`` that the database knows."""
    return tuple(_told(one) for one in refusals(db, week.begins, week.ends) if one.machine not in machines)


def _told(one: StoredRefusal) -> RefusedImport:
    return RefusedImport(
        one.at, one.folder, one.campaign, one.machine, one.fault_count, one.faults, one.cleared_at
    )
