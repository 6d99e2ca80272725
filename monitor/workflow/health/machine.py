"""One machine in one week: its past, its results and its verdict put together as the record of its page."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import compress

from monitor.documents import Said
from monitor.methods import Unable, method_named
from monitor.records import VOLUMETRIC
from monitor.reporting.health.news import CheckKind, NextCheck, NotMeasured
from monitor.reporting.health.records import (
    ALARMS,
    Change,
    DataQuality,
    MachineHealth,
    RefusedImport,
    State,
)
from monitor.reporting.health.sentences import (
    LimitsWithoutParameter,
    LimitWithoutMap,
    MachineNamed,
    RunNamed,
    TolerancesOfType,
)
from monitor.reporting.plain_names import plain_name
from monitor.reporting.run_notes import SimulatedNoted
from monitor.store import (
    Database,
    MachineEvent,
    MachineHistory,
    RecordedRun,
    campaign_tolerances,
    machine_descriptions,
    machine_events,
    machine_history,
    machine_runs,
    simulated_campaigns,
    stored_analyses,
    type_in_use,
)
from monitor.workflow.health.facts import (
    Judgement,
    changes_noted,
    condition_ranges,
    data_quality,
    event_noted,
    moment_of,
    parameter_health,
)
from monitor.workflow.health.failing import failing_since
from monitor.workflow.health.map import probability_beyond, stated_map
from monitor.workflow.health.model import model_health
from monitor.workflow.health.refusals import refused_of
from monitor.workflow.health.request import ReportOptions
from monitor.workflow.health.results import MeasuredWeek, Results, stored_results, stored_with, task_of
from monitor.workflow.health.runs import campaign_span, first_run, past_runs
from monitor.workflow.health.task import Task, TaskResult
from monitor.workflow.health.verdict import (
    conformity_of,
    drifting_named,
    drifting_to_limit,
    drifting_unjudged,
    due_by_drift,
    factor_of,
    imports_refused,
    new_this_week,
    next_check,
    since_when,
    state_of,
    with_effects,
    with_volumetric,
)
from monitor.workflow.health.weeks import Week
from monitor.workflow.history.event_steps import event_steps
from monitor.workflow.history.forecast import drift_forecast
from monitor.workflow.history.limits_of_type import limits_without_parameter
from monitor.workflow.history.past import ParameterPast, machine_past, splitting_events
from monitor.workflow.history.refuted import is_refuted
from monitor.workflow.history.runs import only_runs
from monitor.workflow.models import resolve_for


@dataclass(frozen=True)
class MachineName:
    """A machine as the head of its page names it."""

    machine: str
    description: Said
    location: str


@dataclass(frozen=True)
class MachineWeek:
    """A machine whose past was read up to the end of a week; ``task`` is what its page still lacks.

    ``first`` is its first run of any week. ``measured`` and ``results`` are None for a machine without a run in the
    week.
    """

    name: MachineName
    week: Week
    options: ReportOptions
    runs: Sequence[RecordedRun]
    first: RecordedRun | None
    events: Sequence[MachineEvent]
    refused: tuple[RefusedImport, ...]
    remarks: tuple[Said, ...]
    measured: MeasuredWeek | None = None
    results: Results | None = None
    task: Task | None = None

    @property
    def runs_of_week(self) -> list[RecordedRun]:
        """The runs that began in the week."""
        return [run for run in self.runs if self.week.holds(run.local_start)]


def named_machines(db: Database) -> list[MachineName]:
    """Return every machine that counts, by name."""
    machines = []
    simulated = simulated_campaigns(db)
    for machine in machine_descriptions(db):
        description = MachineNamed(
            machine.manufacturer,
            machine.model,
            machine.serial_number,
            machine.topology,
            machine.machine in simulated,
        )
        machines.append(MachineName(machine.machine, description, machine.location))
    return machines


def read_week(db: Database, name: MachineName, week: Week, options: ReportOptions) -> MachineWeek:
    """Read the past of a machine up to the end of a week."""
    every = machine_runs(db, name.machine)
    runs, remarks = past_runs(every, week, options.campaigns)
    events = [
        event for event in machine_events(db, name.machine) if event.at.replace(tzinfo=None) < week.ends
    ]
    measured = results = task = None
    last = next((run for run in reversed(runs) if week.holds(run.local_start)), None)
    if last is not None:
        measured = MeasuredWeek(
            last,
            campaign_span(every, last.campaign, week),
            resolve_for(db, options.model, last.method, name.machine),
        )
        results = stored_results(db, measured)
        task = task_of(db, name.machine, runs, measured, results)
    return MachineWeek(
        name, week, options, runs, first_run(every, options.campaigns), events,
        refused_of(db, name.machine, week), tuple(remarks), measured, results, task,
    )  # fmt: skip


def machine_health(db: Database, past: MachineWeek, computed: TaskResult) -> MachineHealth:
    """The state of a machine at the end of a week; what was ``computed`` is stored first.

    What fails for one machine is said on its page.
    """
    measured, week = past.measured, past.week
    if measured is None or past.results is None:
        return _not_measured(db, past)
    last = measured.last
    results, failures = stored_with(db, past.results, computed, measured)
    remarks = [*past.remarks, *failures, *_simulated(db, past)]
    stated, explanation = results.uncertainty, results.explanation
    model = measured.model
    history = machine_history(db, past.name.machine, model=model.name, version=model.version)
    history = only_runs(history, past.runs)
    parameter_pasts = machine_past(history, splitting_events(past.events))
    limits = _limits(db, last.campaign, parameter_pasts, remarks)
    limit_um = limits.get(VOLUMETRIC)
    beyond = None if limit_um is None else _beyond(results, limit_um, remarks)
    added = [name for name in parameter_pasts if name.startswith(model.effects)]
    judged = with_effects(conformity_of(stated, limits), parameter_pasts, added, limits)
    judged = with_volumetric(judged, beyond)
    parameters, drifts = [], {}
    names = () if stated is None else tuple(dict.fromkeys((*stated.parameters, *added)))
    topology = past.name.description.topology if isinstance(past.name.description, MachineNamed) else ""
    for name in names:
        if stated is None or name not in parameter_pasts:
            continue
        parameter = parameter_pasts[name]
        drifts[name] = drift_forecast(parameter.drift, limits.get(name))
        starts = [at.replace(tzinfo=None) for at in compress(history.started_at, parameter.mask)]
        judgement = Judgement(limits.get(name), judged.single.get(name), drifts[name])
        in_words = plain_name(name, topology, names)
        parameters.append(parameter_health(parameter, starts, stated, judgement, week, in_words))
    of_campaign = [run for run in past.runs if run.campaign == last.campaign]
    unchanged = _unchanged(parameter_pasts, past.events, of_campaign)
    noted = changes_noted(
        history,
        parameter_pasts,
        past.events,
        event_steps(parameter_pasts, past.events),
        explanation,
        of_campaign,
        week,
    )
    quality = data_quality(db, past.runs_of_week, explanation, stated, past.refused, remarks)
    can_be = not isinstance(method_named(last.method).uncertainty, Unable)
    # A campaign whose identification is refused has no numbers, whatever a robust fit of one run made of it.
    evaluated = (stated is not None and last.campaign not in history.unidentified) or not can_be
    unjudged = drifting_unjudged(parameters)
    state = state_of(
        judged, noted, explanation, quality, past.options.risk, evaluated=evaluated, drifts=bool(unjudged)
    )
    error_map = stated_map(results.map, limit_um, beyond)
    check = next_check(state, drifts, limits, week, _of_latest_day(parameter_pasts, noted))
    due = due_by_drift(state, check)
    drifting = drifting_named(drifting_to_limit(state, parameters, error_map, due), unjudged)
    return MachineHealth(
        past.name.machine, past.name.description, past.name.location, state,
        changed=new_this_week(noted, explanation, quality, drifting),
        since=since_when(state, parameters, noted, failing_since(db, past.runs, measured, explanation), due),
        probability_out=judged.any,
        next_check=check,
        run=_named(last),
        basis="" if stated is None else stated.input_covariance, factor=factor_of(stated),
        parameters=tuple(parameters), changes=tuple(noted), conditions=condition_ranges(past.runs_of_week),
        model=model_health(
            explanation, results.versions, measured.span, unchanged, _refuted_p(history, measured),
        ),
        quality=quality,
        map=error_map, due=due,
    )  # fmt: skip


def _of_latest_day(pasts: Mapping[str, ParameterPast], noted: Sequence[Change]) -> str | None:
    """The parameter that stepped before the latest day alone, in this week or a step that is still open."""
    counting = {change.at for change in noted if change.counts}
    return next(
        (
            name
            for name, past in pasts.items()
            for change in past.search.changes
            if past.is_of_latest_day(change) and moment_of(change.at, past.series) in counting
        ),
        None,
    )


def _simulated(db: Database, past: MachineWeek) -> list[Said]:
    """A remark on the campaigns up to the end of the week that nobody measured."""
    names = {run.campaign for run in past.runs}
    simulated = simulated_campaigns(db, names).get(past.name.machine, ())
    return [SimulatedNoted(simulated, len(names))] if simulated else []


def _refuted_p(history: MachineHistory, measured: MeasuredWeek) -> float | None:
    """Return the p-value of lack of fit where the readings refute the model; None where runs of the campaign are still
    to come, as what is stored is of all of them."""
    fit = history.fits.get(measured.last.campaign)
    if fit is None or measured.span.before is not None or not is_refuted(fit):
        return None
    return fit.lack_of_fit_p


def _limits(
    db: Database, campaign: str, parameters: Collection[str], remarks: list[Said]
) -> dict[str, float]:
    """The tolerances by which a machine is judged; with remarks on those of its type."""
    of_type = type_in_use(db, campaign)
    if of_type is not None:
        remarks.append(TolerancesOfType(of_type.name, campaign))
        without = limits_without_parameter(of_type.name, of_type.limits, parameters)
        remarks += [LimitsWithoutParameter(sentence) for sentence in without]
    return campaign_tolerances(db, campaign)


def _beyond(results: Results, limit_um: float, remarks: list[Said]) -> float | None:
    """The probability that the volumetric error lies beyond its limit; a remark where there is no map."""
    if results.map is not None:
        return probability_beyond(results.map, limit_um)
    remarks.append(LimitWithoutMap(limit_um))
    return None


def _named(run: RecordedRun) -> RunNamed:
    return RunNamed(run.run, run.campaign, run.local_start)


def _left_in_alarm(db: Database, past: MachineWeek) -> str | None:
    """The state that the last report gave the machine's last run, where it was an alarm, or a change that no event
    since then explains: nothing has settled it."""
    for stored in stored_analyses(db, "health", machine=past.name.machine, most=100):
        if stored.document["run"] == str(
            _named(past.runs[-1])
        ):  # a stored report has the run by this text alone
            state = str(stored.document["state"])
            explained = any(
                event.at.replace(tzinfo=None) >= past.runs[-1].local_start for event in past.events
            )
            stays = ALARMS if explained else (*ALARMS, State.CHANGED)
            return state if state in stays else None
    return None


def _not_measured(db: Database, past: MachineWeek) -> MachineHealth:
    """The page of a machine without a run in the week."""
    refused = imports_refused(past.refused)
    if past.runs:
        last, check = past.runs[-1], CheckKind.NO_RUN_THIS_WEEK
        changed = NotMeasured(
            last.campaign, last=last.local_start, state=_left_in_alarm(db, past), refused=refused
        )
    elif past.first is not None:
        check = CheckKind.FIRST_RUN
        changed = NotMeasured(past.first.campaign, first=past.first.local_start, refused=refused)
    else:
        check, changed = CheckKind.NO_RUN_YET, NotMeasured(refused=refused)
    return MachineHealth(
        past.name.machine, past.name.description, past.name.location, State.NOT_MEASURED,
        changed=changed,
        since=past.runs[-1].local_start if past.runs else None, probability_out=None,
        next_check=NextCheck(check), run="", basis="", factor="", parameters=(),
        changes=tuple(event_noted(event, past.week) for event in reversed(past.events)),
        conditions=(), model=None,
        quality=DataQuality(0, 0, 0, (), (), (), (*past.remarks, *_simulated(db, past)), past.refused), map=None,
    )  # fmt: skip


def _unchanged(
    pasts: Mapping[str, ParameterPast], events: Sequence[MachineEvent], runs: Sequence[RecordedRun]
) -> frozenset[str]:
    """The parameters whose history shows no change; none where an event was recorded since the ``runs`` began."""
    first = min(run.local_start for run in runs)
    if any(event.at.replace(tzinfo=None) >= first for event in events):
        return frozenset()
    return frozenset(name for name, past in pasts.items() if not past.search.changes)
