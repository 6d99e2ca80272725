"""Imports that were refused in a week: on the page of their machine, or on the first page where it is not known."""

from __future__ import annotations

from collections.abc import Collection

from monitor.reporting.health.records import RefusedImport
from monitor.store import Database, StoredRefusal, refusals
from monitor.workflow.health.weeks import Week


def refused_of(db: Database, machine: str, week: Week) -> tuple[RefusedImport, ...]:
    """What was refused of one machine in a week."""
    return tuple(
        _stated(refusal) for refusal in refusals(db, week.begins, week.ends) if refusal.machine == machine
    )


def refused_elsewhere(db: Database, machines: Collection[str], week: Week) -> tuple[RefusedImport, ...]:
    """What was refused in a week of none of the ``machines`` that the database knows."""
    return tuple(
        _stated(refusal)
        for refusal in refusals(db, week.begins, week.ends)
        if refusal.machine not in machines
    )


def _stated(refusal: StoredRefusal) -> RefusedImport:
    return RefusedImport(
        refusal.at, refusal.folder, refusal.campaign, refusal.machine, refusal.fault_count, refusal.faults,
        refusal.cleared_at,
    )  # fmt: skip
