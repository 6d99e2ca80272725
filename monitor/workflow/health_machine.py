"""One machine in one week: its past, its results and its verdict put together as the record of its page."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

import numpy as np

from monitor.reporting.health import DataQuality, MachineHealth, RefusedImport
from monitor.store import Database
from monitor.workflow.health_facts import (
    changes_noted,
    conditions_of,
    event_noted,
    parameter_of,
    quality_of,
)
from monitor.workflow.health_history import (
    Event,
    PastRun,
    campaign_span,
    first_run,
    past_events,
    past_runs,
)
from monitor.workflow.health_map import map_told
from monitor.workflow.health_model import model_of
from monitor.workflow.health_refusals import refused_of
from monitor.workflow.health_results import (
    explanation_of,
    history_of,
    identified,
    map_of,
    tolerances_of,
    uncertainty_of,
)
from monitor.workflow.health_series import changes_of, drift_of, series_of
from monitor.workflow.health_verdict import (
    changed_in_words,
    factor_in_words,
    judged_by,
    next_check,
    refusals_in_words,
    since_when,
    state_of,
)
from monitor.workflow.models import resolve
from monitor.workflow.weeks import Week


@dataclass(frozen=True)
class Settings:
    """What the reader of a report chose: the model, the campaigns (empty: all), the probability that alarms."""

    model: str | None = None
    campaigns: tuple[str, ...] = ()
    risk: float = 0.05


def machine_health(
    db: Database, machine: str, description: str, location: str, week: Week, settings: Settings
) -> MachineHealth:
    """The state of a machine at the end of a week. What fails for one machine is said on its page."""
    runs, remarks = past_runs(db, machine, week, settings.campaigns)
    here = [run for run in runs if week.holds(run.at)]
    events = past_events(db, machine, week)
    refused = refused_of(db, machine, week)
    if not here:
        ahead = first_run(db, machine, settings.campaigns)
        return _not_measured(machine, description, location, runs, ahead, events, refused, remarks, week)
    last = here[-1]
    (method,) = db.rows("SELECT method FROM v_campaigns WHERE campaign = ?", [last.campaign])[0]
    model = resolve(db, settings.model, method)
    span = campaign_span(db, last.campaign, week)
    identified(db, machine, method, runs, model, remarks)
    evaluated = uncertainty_of(db, last, model, span, remarks)
    explained = explanation_of(db, last.campaign, method, model, span, remarks)
    mapped = None if evaluated is None else map_of(db, last, model, span, remarks)
    series = series_of(db, machine, model, runs)
    origin = runs[0].at
    changes = changes_of(series, events, origin)
    limits = tolerances_of(db, last.campaign)
    judged = judged_by(evaluated, limits)
    now = (last.at - origin).total_seconds() / 86400.0
    split = [(event.at - origin).total_seconds() / 86400.0 for event in events]
    parameters, drifts = [], {}
    for name, one in series.items():
        if evaluated is None or name not in evaluated["guf"]["u"]:
            continue
        own = changes.get(name, [])
        since = max([change.at for change in own] + [at for at in split if at <= now], default=-np.inf)
        drifts[name] = drift_of(one, since, now, limits.get(name))
        parameters.append(
            parameter_of(
                one, evaluated, limits.get(name), judged.single.get(name), own, drifts[name], origin, week
            )
        )
    noted = changes_noted(changes, series, events, explained, runs, last.campaign, origin, week)
    quality = quality_of(db, here, explained, evaluated, refused, remarks)
    state = state_of(judged, noted, explained, quality, settings.risk)
    return MachineHealth(
        machine, description, location, state,
        changed=changed_in_words(noted, explained, quality),
        since=since_when(state, parameters, noted, span.first), probability_out=judged.any,
        next_check=next_check(state, drifts, limits, last.at, week),
        run=f"run {last.run} of campaign {last.campaign}, {last.at:%Y-%m-%d %H:%M}",
        basis="" if evaluated is None else evaluated["input_covariance"], factor=factor_in_words(evaluated),
        parameters=tuple(parameters), changes=tuple(noted), conditions=conditions_of(here),
        model=model_of(explained, history_of(db, last.campaign, model, span, remarks), span), quality=quality,
        map=map_told(mapped),
    )  # fmt: skip


def _not_measured(
    machine: str,
    description: str,
    location: str,
    runs: list[PastRun],
    ahead: tuple[datetime, str] | None,
    events: list[Event],
    refused: tuple[RefusedImport, ...],
    remarks: list[str],
    week: Week,
) -> MachineHealth:
    if runs:
        check = "now: no run this week"
        said = f"no run this week; its last run was on {runs[-1].at:%Y-%m-%d} ({runs[-1].campaign})"
    elif ahead is not None:
        check = "its first run"
        said = f"not yet measured in this week: its first run was on {ahead[0]:%Y-%m-%d} ({ahead[1]})"
    else:
        check = "now: no run yet"
        said = "not yet measured: the database holds no run of it"
    said = "; ".join([said, *refusals_in_words(refused)])
    noted = [event_noted(one, week) for one in reversed(events)]
    quality = DataQuality(0, 0, 0, (), (), (), tuple(remarks), refused)
    return MachineHealth(
        machine, description, location, "not measured",
        changed=said, since=runs[-1].at if runs else None, probability_out=None,
        next_check=check, run="", basis="", factor="", parameters=(), changes=tuple(noted),
        conditions=(), model=None, quality=quality, map=None,
    )  # fmt: skip
