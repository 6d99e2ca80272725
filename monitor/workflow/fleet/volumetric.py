"""The volumetric error of every machine with a limit of it, as rows of the fleet."""

from __future__ import annotations

from monitor.records import VOLUMETRIC
from monitor.store import Database, latest_maps, latest_tolerances
from monitor.units import MICROMETRE
from monitor.workflow.fleet.answer import FleetTableRow
from monitor.workflow.fleet.attention import Attention


def share_of_limit(row: FleetTableRow) -> float:
    """The part of its limit that a volumetric error takes, 0 where there is none."""
    return 0.0 if row.latest is None or row.limit is None else row.latest / row.limit


def volumetric_rows(db: Database, machines: set[str]) -> list[FleetTableRow]:
    """A row for every machine with a limit of the volumetric error: the worst error of its last map against it.

    The map is that of the latest run of which one was stored, by ``map`` or by a weekly report; without one the limit
    is not judged.
    """
    limits = {
        machine: limit
        for (machine, name), limit in latest_tolerances(db).items()
        if name == VOLUMETRIC and machine in machines
    }
    worst = latest_maps(db) if limits else {}
    rows = []
    for machine, limit in limits.items():
        latest = worst.get(machine)
        attention = Attention.OUT if latest is not None and latest >= limit else Attention.AS_USUAL
        if latest is None:
            attention = Attention.UNJUDGED
        rows.append(
            FleetTableRow(
                rank=0, machine=machine, parameter="volumetric error", attention=attention, unit=MICROMETRE.name,
                n=0 if latest is None else 1, days=0 if latest is None else 1, mean=latest, sd_all=None, sd_pooled=None,
                between_days=None, bartlett=None, bartlett_p=None, bartlett_q=None, anova_f=None, anova_p=None,
                anova_q=None, slope_per_year=None, u_slope=None, drift_p=None, drift_q=None, latest=latest,
                slope_widening=None, latest_at=None, since=None, limit=limit, years_to_limit=None,
            )
        )  # fmt: skip
    return rows
