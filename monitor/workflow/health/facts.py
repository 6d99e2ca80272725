"""What stands on a machine's page of the health report, put together from stored documents and found changes."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Any

import numpy as np

from monitor.reporting.health.records import (
    Change,
    ConditionRange,
    DataQuality,
    Drift,
    History,
    ParameterHealth,
    RefusedImport,
)
from monitor.reporting.health.words import in_words
from monitor.reporting.symbols import describe
from monitor.statistics import Change as Found
from monitor.store import Database, campaign_notes
from monitor.units import COLUMN_UNITS
from monitor.workflow.health.weeks import Week
from monitor.workflow.history.health_history import Event, PastRun
from monitor.workflow.history.health_series import DriftFound, Series, moment
from monitor.workflow.trend.parameter import SHORTEST_DAYS

Document = dict[str, Any]


def parameter_of(
    one: Series,
    evaluated: Document,
    tolerance: float | None,
    probability_out: float | None,
    changes: list[Found],
    drift: DriftFound | None,
    origin: datetime,
    week: Week,
) -> ParameterHealth:
    guf = evaluated["guf"]
    beyond = None
    if tolerance is not None and abs(one.values[-1]) > tolerance:
        inside = np.flatnonzero(np.abs(one.values) <= tolerance)
        beyond = one.times[int(inside[-1]) + 1 if inside.size else 0]
    return ParameterHealth(
        name=one.name,
        description=describe(one.name),
        unit=evaluated["units"][one.name],
        estimate=float(guf["estimate"][one.name]),
        u=float(guf["u"][one.name]),
        expanded=float(guf["expanded"][one.name]),
        tolerance=tolerance,
        probability_out=probability_out,
        out_since=beyond,
        history=History(
            one.times,
            tuple(one.values.tolist()),
            tuple(one.u.tolist()),
            tuple(week.holds(at) for at in one.times),
        ),
        changed_at=tuple(origin + timedelta(days=change.at) for change in changes),
        # Scatter of a few days, stated a year, would only mislead.
        drift=None if drift is None or drift.horizon < SHORTEST_DAYS else _drift(drift, origin),
    )


def _drift(found: DriftFound, origin: datetime) -> Drift:
    def day(days: float | None) -> Any:
        at = None if days is None else moment(origin, days)
        return None if at is None else at.date()

    return Drift(
        found.slope,
        found.u_slope,
        found.between,
        found.p_value,
        day(found.crosses),
        (day(found.crosses_between[0]), day(found.crosses_between[1])),
    )


def changes_noted(
    found: dict[str, list[Found]],
    series: dict[str, Series],
    events: list[Event],
    explained: Document | None,
    runs: list[PastRun],
    campaign: str,
    origin: datetime,
    week: Week,
) -> list[Change]:
    """Everything that changed, the latest first."""
    noted = [
        Change(
            "change",
            origin + timedelta(days=one.interval[0]),
            origin + timedelta(days=one.at),
            _change_words(one, series[name].unit),
            one.p_value,
            week.holds(origin + timedelta(days=one.at)),
        )
        for name, every in found.items()
        for one in every
    ]
    at = {run.run: run.at for run in runs if run.campaign == campaign}
    for move in (explained or {}).get("changes", []):
        if "target" in move and move["run"] in at:
            words = f"ball {move['target']} moved by {move['size']:.1f} {move['unit']} (run {move['run']})"
            moved = at[move["run"]]
            noted.append(Change("change", None, moved, words, move["p_value"], week.holds(moved)))
    noted += [event_noted(event, week) for event in events]
    return sorted(noted, key=lambda one: one.at, reverse=True)


def event_noted(one: Event, week: Week) -> Change:
    return Change("event", None, one.at, f"{one.kind}: {one.what}", None, week.holds(one.at))


def _change_words(one: Found, unit: str) -> str:
    size, u = in_words(one.size, one.u, sign=True)
    if one.kind == "step":
        return f"{one.parameter} stepped by {size} {unit} (u = {u} {unit})"
    if one.kind == "slope":
        return f"{one.parameter} began to drift by {size} {unit} a day (u = {u} {unit} a day)"
    return f"{one.parameter}: {one.kind} of {size} {unit} (u = {u} {unit})"


def conditions_of(here: list[PastRun]) -> tuple[ConditionRange, ...]:
    names = sorted({name for run in here for name in run.conditions})
    found = []
    for name in names:
        stem, _, suffix = name.rpartition("_")
        unit = COLUMN_UNITS.get(suffix) if stem else None
        values = [run.conditions[name] for run in here if name in run.conditions]
        words = (stem if unit else name).replace("_", " ")
        found.append(
            ConditionRange(words, unit.name if unit else "", min(values), float(np.mean(values)), max(values))
        )
    return tuple(found)


def quality_of(
    db: Database,
    here: list[PastRun],
    explained: Document | None,
    evaluated: Document | None,
    refused_imports: tuple[RefusedImport, ...],
    remarks: list[str],
) -> DataQuality:
    """What the data of the week's runs ``here`` are worth; without a result, what depends on it is empty."""
    runs = {(run.campaign, run.run) for run in here}
    counts = {
        (campaign, run): count
        for name in {run.campaign for run in here}
        for campaign, run, count in db.rows(
            "SELECT campaign, run, count(*) FROM v_probings WHERE campaign = ? GROUP BY ALL", [name]
        )
    }
    noticed = [note for name in sorted({run.campaign for run in here}) for note in campaign_notes(db, name)]
    suspect = tuple(
        f"run {one['run']}, touch {one['sequence']}, ball {one['target']}: "
        f"{one['axis']} is off by {one['size_um']:.1f} µm"
        for one in (explained or {}).get("suspect_data", [])
        if ((explained or {}).get("campaign"), one["run"]) in runs
    )
    return DataQuality(
        runs=len(here),
        probings=sum(counts.get(one, 0) for one in runs),
        warm_up_runs=sum(run.warm_up for run in here),
        suspect=suspect,
        refused=tuple(
            (", ".join(one["parameters"]), one["why"]) for one in (evaluated or {}).get("refused", [])
        ),
        blind_spots=tuple((explained or {}).get("blind_spots", [])),
        remarks=(*noticed, *remarks),
        refused_imports=refused_imports,
    )
