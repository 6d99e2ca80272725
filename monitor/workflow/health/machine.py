"""One machine in one week: its past, its results and its verdict put together as the record of its page."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np

from monitor.reporting.health.records import ALARMS, DataQuality, MachineHealth, RefusedImport
from monitor.store import NOTE, Database, StoredModel, stored_analyses
from monitor.workflow.health.facts import (
    changes_noted,
    conditions_of,
    event_noted,
    parameter_of,
    quality_of,
)
from monitor.workflow.health.map import map_told
from monitor.workflow.health.model import model_of
from monitor.workflow.health.refusals import refused_of
from monitor.workflow.health.results import Results, found_in, stored_with, tolerances_of, work_of
from monitor.workflow.health.verdict import (
    changed_in_words,
    factor_in_words,
    judged_by,
    next_check,
    refusals_in_words,
    since_when,
    state_of,
)
from monitor.workflow.health.weeks import Week
from monitor.workflow.health.work import Done, Work
from monitor.workflow.history.health_history import (
    Event,
    PastRun,
    Span,
    campaign_span,
    first_run,
    past_events,
    past_runs,
)
from monitor.workflow.history.health_series import changes_of, drift_of, series_of
from monitor.workflow.models import resolve


@dataclass(frozen=True)
class Settings:
    """What the reader of a report chose: the model, the campaigns (empty: all), the probability that alarms."""

    model: str | None = None
    campaigns: tuple[str, ...] = ()
    risk: float = 0.05


@dataclass(frozen=True)
class Begun:
    """A machine whose past was read; ``work`` is what its page still lacks.

    ``model``, ``span`` and ``found`` are None for a machine that was not measured in the week.
    """

    machine: str
    description: str
    location: str
    week: Week
    settings: Settings
    runs: list[PastRun]
    events: list[Event]
    refused: tuple[RefusedImport, ...]
    remarks: list[str]
    method: str = ""
    model: StoredModel | None = None
    span: Span | None = None
    found: Results | None = None
    work: Work | None = None

    @property
    def here(self) -> list[PastRun]:
        """The runs of the week."""
        return [run for run in self.runs if self.week.holds(run.at)]

    @property
    def last(self) -> PastRun | None:
        """The last run of the week."""
        return self.here[-1] if self.here else None


def begun(
    db: Database, machine: str, description: str, location: str, week: Week, settings: Settings
) -> Begun:
    """Read the past of a machine up to the end of a week."""
    runs, remarks = past_runs(db, machine, week, settings.campaigns)
    events = past_events(db, machine, week)
    refused = refused_of(db, machine, week)
    past = Begun(machine, description, location, week, settings, runs, events, refused, remarks)
    last = past.last
    if last is None:
        return past
    (method,) = db.rows("SELECT method FROM v_campaigns WHERE campaign = ?", [last.campaign])[0]
    model = resolve(db, settings.model, method)
    span = campaign_span(db, last.campaign, week)
    found = found_in(db, last, method, model, span)
    work = work_of(db, machine, runs, last, method, model, span, found)
    return replace(past, method=method, model=model, span=span, found=found, work=work)


def machine_health(db: Database, past: Begun, done: Done) -> MachineHealth:
    """The state of a machine at the end of a week, what was ``done`` stored first. What fails for one machine is said
    on its page."""
    machine, description, location, week = past.machine, past.description, past.location, past.week
    runs, events, refused, remarks, settings = (
        past.runs, past.events, past.refused, list(past.remarks), past.settings
    )  # fmt: skip
    last = past.last
    if last is None or past.model is None or past.span is None or past.found is None:
        ahead = first_run(db, machine, settings.campaigns)
        left = _left_in_alarm(db, machine, runs)
        return _not_measured(
            machine, description, location, runs, ahead, events, refused, remarks, week, left
        )
    model, span, here = past.model, past.span, past.here
    results = stored_with(db, past.found, done, past.method, model, span, remarks)
    evaluated, explained = results.uncertainty, results.explanation
    series = series_of(db, machine, model, runs)
    origin = runs[0].at
    splitting = [event for event in events if event.kind != NOTE]
    changes = changes_of(series, splitting, origin)
    limits = tolerances_of(db, last.campaign)
    judged = judged_by(evaluated, limits)
    now = (last.at - origin).total_seconds() / 86400.0
    split = [(event.at - origin).total_seconds() / 86400.0 for event in splitting]
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
        run=_words_of(last),
        basis="" if evaluated is None else evaluated["input_covariance"], factor=factor_in_words(evaluated),
        parameters=tuple(parameters), changes=tuple(noted), conditions=conditions_of(here),
        model=model_of(explained, list(results.history or ()), span), quality=quality,
        map=map_told(results.map),
    )  # fmt: skip


def _words_of(run: PastRun) -> str:
    return f"run {run.run} of campaign {run.campaign}, {run.at:%Y-%m-%d %H:%M}"


def _left_in_alarm(db: Database, machine: str, runs: list[PastRun]) -> str:
    """What the last report said of the machine's last run, where that was an alarm: nothing has settled it since."""
    if not runs:
        return ""
    for one in stored_analyses(db, "health", machine=machine, most=100):
        if one.document["run"] == _words_of(runs[-1]):
            state = str(one.document["state"])
            return f", when it was reported as: {state}" if state in ALARMS else ""
    return ""


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
    left: str,
) -> MachineHealth:
    if runs:
        check = "now: no run this week"
        said = f"no run this week; its last run was on {runs[-1].at:%Y-%m-%d} ({runs[-1].campaign}){left}"
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
