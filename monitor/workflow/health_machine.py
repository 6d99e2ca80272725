"""One machine in one week: what is stored is used, what the week's campaign still lacks is computed and stored."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from monitor.exceptions import MonitorError, NotFoundError
from monitor.reporting.health import (
    ALARMS,
    Change,
    DataQuality,
    MachineHealth,
    ParameterHealth,
    State,
)
from monitor.store import Database, StoredModel, load_analysis
from monitor.uncertainty.conformity import conformity
from monitor.workflow.comparison import explain_campaign
from monitor.workflow.health_facts import (
    changes_noted,
    conditions_of,
    event_noted,
    model_of,
    parameter_of,
    quality_of,
)
from monitor.workflow.health_history import (
    DriftFound,
    Event,
    PastRun,
    campaign_span,
    changes_of,
    drift_of,
    first_run,
    past_events,
    past_runs,
    series_of,
)
from monitor.workflow.health_map import stored_map
from monitor.workflow.identification import identify
from monitor.workflow.models import label, resolve
from monitor.workflow.uncertainty import uncertainty
from monitor.workflow.weeks import Week

Document = dict[str, Any]


@dataclass(frozen=True)
class Settings:
    """What the reader of a report chose: the model, the campaigns (empty: all), the probability that alarms."""

    model: str | None = None
    campaigns: tuple[str, ...] = ()
    risk: float = 0.05


@dataclass(frozen=True)
class _Judged:
    """Probability of each parameter and of any of them to be out; None where no tolerance is stated."""

    single: dict[str, float]
    any: float | None
    every_has_one: bool


def machine_health(
    db: Database, machine: str, description: str, location: str, week: Week, settings: Settings
) -> MachineHealth:
    """The state of a machine at the end of a week. What fails for one machine is said on its page."""
    runs, remarks = past_runs(db, machine, week, settings.campaigns)
    here = [run for run in runs if week.holds(run.at)]
    events = past_events(db, machine, week)
    if not here:
        ahead = first_run(db, machine, settings.campaigns)
        return _not_measured(machine, description, location, runs, ahead, events, remarks, week)
    last = here[-1]
    (method,) = db.rows("SELECT method FROM v_campaigns WHERE campaign = ?", [last.campaign])[0]
    model = resolve(db, settings.model, method)
    _identified(db, here, model, remarks)
    evaluated = _kept(
        lambda: _uncertainty(db, last, model),
        "the uncertainty of the last run could not be evaluated",
        remarks,
    )
    explained = _kept(
        lambda: _explanation(db, last.campaign, model), "model and measurement could not be compared", remarks
    )
    series = series_of(db, machine, model, runs)
    origin = runs[0].at
    changes = changes_of(series, events, origin)
    limits = _tolerances(db, last.campaign)
    judged = _judged(evaluated, limits)
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
    quality = quality_of(db, here, explained, evaluated, remarks)
    state = _state(judged, noted, explained, quality, settings.risk)
    return MachineHealth(
        machine, description, location, state,
        changed=_changed(noted), since=_since(state, parameters, noted), probability_out=judged.any,
        next_check=_next_check(state, drifts, limits, last.at),
        run=f"run {last.run} of campaign {last.campaign}, {last.at:%Y-%m-%d %H:%M}",
        basis="" if evaluated is None else evaluated["input_covariance"], factor=_factor(evaluated),
        parameters=tuple(parameters), changes=tuple(noted), conditions=conditions_of(here),
        model=model_of(explained, campaign_span(db, last.campaign)), quality=quality,
        map=stored_map(db, last.campaign, [run.run for run in here if run.campaign == last.campaign], model),
    )  # fmt: skip


def _kept(step: Callable[[], Document], failure: str, remarks: list[str]) -> Document | None:
    """The result of a step, or a remark that says why there is none: one machine does not stop the fleet's report."""
    try:
        return step()
    except MonitorError as error:
        remarks.append(f"{failure}: {error}")
        return None


def _identified(db: Database, here: list[PastRun], model: StoredModel, remarks: list[str]) -> None:
    done = set(
        db.rows(
            "SELECT campaign, run FROM v_identified_runs WHERE model = ? AND model_version = ?",
            [model.name, model.version],
        )
    )
    for campaign in dict.fromkeys(one.campaign for one in here if (one.campaign, one.run) not in done):
        _kept(
            lambda name=campaign: identify(db, name, label(model)),  # type: ignore[misc]
            f"campaign {campaign} could not be identified",
            remarks,
        )


def _uncertainty(db: Database, last: PastRun, model: StoredModel) -> Document:
    try:
        found = load_analysis(
            db, "uncertainty", campaign=last.campaign, run=last.run, model=model.name, model_version=model.version
        )  # fmt: skip
        return dict(found.document)
    except NotFoundError:
        return uncertainty(db, last.campaign, last.run, model=label(model), method="guf")


def _explanation(db: Database, campaign: str, model: StoredModel) -> Document:
    try:
        found = load_analysis(
            db, "explanation", campaign=campaign, model=model.name, model_version=model.version
        )
        return dict(found.document)
    except NotFoundError:
        return explain_campaign(db, campaign, label(model))[0]


def _tolerances(db: Database, campaign: str) -> dict[str, float]:
    rows = db.rows(
        "SELECT parameter, tolerance FROM v_tolerances WHERE campaign = ? AND tolerance IS NOT NULL",
        [campaign],
    )
    return {str(parameter): float(tolerance) for parameter, tolerance in rows}


def _judged(evaluated: Document | None, limits: dict[str, float]) -> _Judged:
    if evaluated is None:
        return _Judged({}, None, False)
    guf = evaluated["guf"]
    names = list(evaluated["parameters"])
    if not any(name in limits for name in names):
        return _Judged({}, None, False)
    u = np.array([guf["u"][name] for name in names])
    covariance = np.array(guf["correlation"]) * np.outer(u, u)
    limit = np.array([limits.get(name, np.inf) for name in names])
    dof = guf["degrees_of_freedom"]
    found = conformity(
        [guf["estimate"][name] for name in names], covariance, -limit, limit, dof=np.inf if dof is None else dof
    )  # fmt: skip
    single = {name: float(1.0 - p) for name, p in zip(names, found.single, strict=True) if name in limits}
    return _Judged(single, float(1.0 - found.joint), all(name in limits for name in names))


def _changed(noted: list[Change]) -> str:
    own = [one.what for kind in ("change", "event") for one in noted if one.this_week and one.kind == kind]
    if not own:
        return "nothing this week"
    return "; ".join(own[:3]) + (f"; and {len(own) - 3} more" if len(own) > 3 else "")


def _since(state: State, parameters: list[ParameterHealth], noted: list[Change]) -> datetime | None:
    """Since when the machine is in this state: beyond a tolerance, or another one than before."""
    beyond = [one.out_since for one in parameters if one.out_since is not None]
    if state == "out of tolerance" and beyond:
        return min(beyond)
    changed = [one.at for one in noted if one.kind == "change"]
    if state == "changed":
        changed = [one.at for one in noted if one.kind == "change" and one.this_week]
        return min(changed)
    return max(changed, default=None)


def _state(
    judged: _Judged, noted: list[Change], explained: Document | None, quality: DataQuality, risk: float
) -> State:
    if judged.any is not None and max(judged.single.values()) > 0.5:
        return "out of tolerance"
    if judged.any is not None and judged.any > risk:
        return "may be out of tolerance"
    if any(one.kind == "change" and one.this_week for one in noted):
        return "changed"
    if explained is not None and explained["verdict"] == "something is missing":
        return "model fails"
    if quality.suspect:
        return "suspect data"
    return "in tolerance" if judged.every_has_one else "no change seen"


def _next_check(
    state: State, drifts: dict[str, DriftFound | None], limits: dict[str, float], last: datetime
) -> str:
    known = {
        name: one.good_for for name, one in drifts.items() if one is not None and one.good_for is not None
    }
    if state in ALARMS:
        return "now"
    if not limits:
        return "no forecast: the campaign states no tolerances"
    if not known:
        return "no forecast: fewer than three days since the last change"
    name = min(known, key=lambda one: known[one])
    found = drifts[name]
    assert found is not None
    day = (last + timedelta(days=known[name])).date()
    if known[name] >= found.horizon:
        return f"by {day}: in tolerance as far ahead as the history is long"
    return f"by {day}: {name} stays in tolerance with 95 % until then"


def _factor(evaluated: Document | None) -> str:
    if evaluated is None:
        return "no uncertainty"
    guf = evaluated["guf"]
    k_q, dof = guf["k_q_with_degrees_of_freedom"], guf["degrees_of_freedom"]
    freedom = "" if dof is None else f", {dof:.0f} degrees of freedom"
    count, percent = len(evaluated["parameters"]), evaluated["p"] * 100
    return f"U = {k_q:.2f} u: all {count} intervals hold at once with {percent:g} %{freedom}"


def _not_measured(
    machine: str,
    description: str,
    location: str,
    runs: list[PastRun],
    ahead: tuple[datetime, str] | None,
    events: list[Event],
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
    noted = [event_noted(one, week) for one in reversed(events)]
    return MachineHealth(
        machine, description, location, "not measured",
        changed=said, since=runs[-1].at if runs else None, probability_out=None,
        next_check=check, run="", basis="", factor="", parameters=(), changes=tuple(noted),
        conditions=(), model=None, quality=DataQuality(0, 0, 0, (), (), (), tuple(remarks)), map=None,
    )  # fmt: skip
