"""The volumetric error of every machine with a limit of it, as rows of the fleet."""

from __future__ import annotations

from itertools import takewhile
from typing import Any

from monitor.records import VOLUMETRIC
from monitor.store import Database, MappedRun, latest_tolerances, mapped_runs
from monitor.units import MICROMETRE
from monitor.workflow.fleet.answer import FleetTableRow
from monitor.workflow.fleet.attention import Attention, Onset
from monitor.workflow.history.beyond_limit import RISK, longest_beyond


def share_of_limit(row: FleetTableRow) -> float:
    """The part of its limit that a volumetric error takes, 0 where there is none."""
    return 0.0 if row.latest is None or row.limit is None else row.latest / row.limit


def volumetric_rows(db: Database, machines: set[str]) -> list[FleetTableRow]:
    """A row for every machine with a limit of the volumetric error: the worst error of its last map against it.

    The map is that of the latest run of which one was stored, by ``map`` or by a weekly report; without one the limit
    is not judged. An error within its limit may be beyond it by the uncertainty of that map. An error beyond its limit
    holds since the first of the mapped runs that are beyond it without a break, any other since its last map.
    """
    limits = {
        machine: limit
        for (machine, name), limit in latest_tolerances(db).items()
        if name == VOLUMETRIC and machine in machines
    }
    mapped = mapped_runs(db) if limits else {}
    rows = []
    for machine, limit in limits.items():
        runs = mapped.get(machine, [])
        latest = runs[-1].worst_um if runs else None
        out = _probability_out(runs[-1], limit) if runs else None
        attention = _attention(latest, limit, out)
        rows.append(
            FleetTableRow(
                rank=0, machine=machine, parameter="volumetric error", attention=attention, unit=MICROMETRE.name,
                n=0 if latest is None else 1, days=0 if latest is None else 1, mean=latest, sd_all=None, sd_pooled=None,
                between_days=None, bartlett=None, bartlett_p=None, bartlett_q=None, anova_f=None, anova_p=None,
                anova_q=None, slope_per_year=None, u_slope=None, drift_p=None, drift_q=None, latest=latest,
                slope_widening=None, latest_at=runs[-1].started_at.isoformat() if runs else None, since=None,
                limit=limit, years_to_limit=None, probability_out=out, **_onset(runs, limit),
            )
        )  # fmt: skip
    return rows


def _attention(latest: float | None, limit: float, out: float | None) -> Attention:
    """Return the class of a worst error by its limit and the probability that it is ``out``."""
    if latest is None or out is None:
        return Attention.UNJUDGED
    if latest >= limit:
        return Attention.OUT
    return Attention.MAY_BE_OUT if out > RISK else Attention.AS_USUAL


def _probability_out(run: MappedRun, limit: float) -> float:
    """Return the probability that the worst error of a map is beyond its limit, as the weekly report does."""
    return longest_beyond(run.worst_um - limit, run.u_um or 0.0, run.degrees_of_freedom)


def _onset(runs: list[MappedRun], limit: float) -> dict[str, Any]:
    """Since when an error holds, and what began then; nothing without a map."""
    if not runs:
        return {}
    beyond = list(takewhile(lambda run: run.worst_um >= limit, reversed(runs)))
    first = beyond[-1] if beyond else runs[-1]
    return {
        "onset": first.started_at.isoformat(),
        "onset_is": Onset.MAPPED if beyond else Onset.LAST_MAP,
    }
