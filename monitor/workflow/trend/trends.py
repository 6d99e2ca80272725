"""The long view of one machine: drift, changes, dependence, cycles, warm-up, alarms, forecast of each parameter."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from monitor.documents import to_document
from monitor.exceptions import DataError, InputError, NotFoundError, did_you_mean
from monitor.records import VOLUMETRIC, Array
from monitor.reporting import calibration_messages, messages
from monitor.statistics import Change
from monitor.store import (
    NOTE,
    Database,
    MachineEvent,
    MachineHistory,
    followed_by,
    latest_text,
    machine_events,
    machine_history,
    numbered_by,
    older_numbers,
    parameter_frames,
    save_analysis,
    simulated_campaigns,
    tolerance_types,
)
from monitor.workflow.copied_readings import copies_in_history
from monitor.workflow.history.agreement import agreement
from monitor.workflow.history.calendar import SECONDS_PER_DAY, date, days_since_1970
from monitor.workflow.history.changes import FALSE_ALARM, SEED
from monitor.workflow.history.event_steps import EventStep, event_steps
from monitor.workflow.history.forecast import NEXT_CHECK_D
from monitor.workflow.history.in_common import calibrated_to, stated_differently
from monitor.workflow.history.limits_of_type import limits_without_parameter
from monitor.workflow.history.other_instruments import OtherInstruments, between_instruments
from monitor.workflow.history.past import ParameterPast, machine_past, splitting_events
from monitor.workflow.history.refuted import (
    ContradictedStatement,
    ModelRefuted,
    model_refuted,
    statements_contradicted,
)
from monitor.workflow.history.runs import same_hours, selected_campaigns
from monitor.workflow.trend.answer import (
    ParameterTrend,
    RecordedEvent,
    StepAtEvent,
    TrendAnswer,
)
from monitor.workflow.trend.causes import METHOD, conditions, cycles
from monitor.workflow.trend.charts_answer import ControlCharts
from monitor.workflow.trend.control import Charts
from monitor.workflow.trend.discovery_rates import with_discovery_rates
from monitor.workflow.trend.forecast import backtested, limit_forecast
from monitor.workflow.trend.parameter import calibrations, dated_change, drift_statement, latest_mean
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.volumetric import LimitQuestion, volumetric_forecast
from monitor.workflow.trend.warming import warming

#: What the stored answer about a whole machine is called.
WHOLE = "all parameters"


def trend(db: Database, request: TrendRequest) -> TrendAnswer:
    """Follow every parameter of a machine; the answer is stored where nothing but the machine was named.

    Raises NotFoundError for a machine or parameter that is not there, InputError for dates that cannot be.
    """
    request = request.at_machine(db)
    history, refused = _history(db, request)
    events = machine_events(db, request.machine)
    # Read before anything is computed: the file is let go of when nothing was asked for a moment.
    refers_to = parameter_frames(db, request.machine, history.parameters)
    is_stored = len(history.run) > 0 and request.is_plain and not db.read_only
    latest = None
    if is_stored and not db.is_lake:
        latest = latest_text(db, "trend", method=WHOLE, machine=request.machine)
    past = machine_past(history, splitting_events(events)) if len(history.run) else {}
    answer = _answer(db, request, history, events, past, refers_to, refused)
    if past and is_stored:
        save_analysis(
            db, "trend", to_document(answer), method=WHOLE, machine=request.machine, seed=SEED, repeated=False,
            latest=latest,
        )  # fmt: skip
    answer = replace(answer, copied_readings=copies_in_history(db, answer.campaigns))
    if request.weekly_looks:
        from monitor.workflow.history.weekly_looks import weekly_notices

        answer = replace(answer, weekly_looks=weekly_notices(db).of_machines({request.machine}))
    if request.figures is None:
        return answer
    # Loaded here: the libraries that draw take longer to load than a page to make.
    from monitor.workflow.trend.figures import trend_figures

    return replace(answer, figures=trend_figures(answer, past, request.figures))


def _history(db: Database, request: TrendRequest) -> tuple[MachineHistory, dict[str, str]]:
    """The history of a machine, of all parameters: what one of them changed by is told with what all of them show, and
    with the same probability, whoever asks for it alone. Campaigns not yet identified are identified first where the
    database may be written; with what `identify` says of those that it refuses, by name.

    While none is identified by the newest version of a method's own model, that of the newest which one is.
    """
    machine = request.machine
    model, version = None, None
    if request.model is not None:
        from monitor.workflow.models import resolve

        stored = resolve(db, request.model)
        model, version = stored.name, stored.version

    def read(by: Mapping[str, tuple[str, int]]) -> MachineHistory:
        return machine_history(
            db, machine, model=model, version=version, since=request.since, followed_by=by,
        )  # fmt: skip

    by = followed_by(db, machine)
    history, is_new = read(by), False
    refused: dict[str, str] = {}
    if not db.read_only and history.unidentified:
        # Loaded here: most pages have nothing to identify, and the methods take as long to load as a page to make.
        from monitor.workflow.identify.identify import identify
        from monitor.workflow.identify.request import IdentifyRequest

        for campaign in history.unidentified:
            try:
                identify(db, IdentifyRequest(campaign, request.model))
                is_new = True
            except DataError as refusal:
                # A campaign that cannot be identified does not keep the others from being followed.
                refused[campaign] = str(refusal)
    numbered = numbered_by(db, machine)
    if is_new or numbered != by:
        history = read(numbered)
    history = _shown(selected_campaigns(history, request.campaigns), request)
    if request.parameter is not None and len(history.run) and request.parameter not in history.parameters:
        every = history.parameters
        hint = did_you_mean(request.parameter, every)
        raise NotFoundError(
            f"machine {machine} has no parameter {request.parameter!r}; {hint}it has {', '.join(every) or 'none yet'}"
        )
    return history, refused


def _shown(history: MachineHistory, request: TrendRequest) -> MachineHistory:
    """The runs before the end of the period, of a method, that warm up or do not, as far as these are asked for."""
    is_shown = np.ones(len(history.run), dtype=np.bool_)
    if request.until is not None:
        is_shown &= history.seconds < request.until.timestamp()
    if request.method is not None:
        is_shown &= history.method == request.method
    if request.warm_up is not None:
        is_shown &= history.warm_up == request.warm_up
    return history.part(is_shown)


def _answer(
    db: Database,
    request: TrendRequest,
    whole: MachineHistory,
    events: list[MachineEvent],
    every: Mapping[str, ParameterPast],
    refers_to: Mapping[str, str],
    refused: Mapping[str, str],
) -> TrendAnswer:
    """The answer from the history and the past of all parameters, about those that were asked for."""
    asked = request.parameter
    history = whole if asked is None else whole.own_copy(asked)
    past = {name: parameter for name, parameter in every.items() if asked in (None, name)}
    refuted, contradicted = model_refuted(history), _contradicted(db, request, history)
    head = TrendAnswer(
        machine=request.machine,
        since=None if request.since is None else request.since.isoformat(),
        runs=len(history.run),
        campaigns=tuple(dict.fromkeys(history.campaign.tolist())),
        methods=tuple(dict.fromkeys(history.method.tolist())),
        agreement=agreement(db, history, [event for event in events if event.kind != NOTE]),
        events=tuple(RecordedEvent(event.at.isoformat(), event.kind, event.description) for event in events),
        notes=(
            *map(str, same_hours(history)),
            *_simulated(db, history),
            *_not_followed(history, refused),
            *_of_older_version(db, request),
            *_limits_of_type(db, history, past if request.parameter is None else None),
            *_refuted(refuted),
            *([] if contradicted is None else [_contradicting(contradicted)]),
            *_calibrations(history),
        ),
        false_alarm=FALSE_ALARM,
        seed=SEED,
        why=None if past else _why_none(request),
        parameters={},
        refers_to={name: refers_to[name] for name in past if name in refers_to},
        model_refuted=refuted,
        statement_contradicted=contradicted,
    )
    if not past:
        return head
    offset = next(iter(past.values())).series.offset
    reference = request.reference
    charts = Charts(
        history,
        offset,
        splitting_events(events),
        None if reference is None else (days_since_1970(reference[0]), days_since_1970(reference[1])),
    )
    check = _next_check(history, request)
    page = _Page(request, history, charts, check, between_instruments(whole, every, splitting_events(events)))
    parameters = with_discovery_rates({name: page.parameter(parameter) for name, parameter in past.items()})
    parameters = _with_event_steps(parameters, event_steps(every, events))
    control = ControlCharts(
        charts.period(), charts.of_vector(history.parameters, np.random.default_rng(SEED))
    )
    volumetric = None
    if request.parameter is None:
        question = LimitQuestion(request.volumetric_limit_um, check, request.reliability, request.model)
        drifts = {name: parameter.drift for name, parameter in past.items()}
        volumetric = volumetric_forecast(db, history, drifts, question, np.random.default_rng([SEED, 1]))
    return replace(
        head,
        next_check=date(check, offset),
        control=control,
        parameters=parameters,
        volumetric_error=volumetric,
    )


def _limits_of_type(db: Database, history: MachineHistory, past: Collection[str] | None) -> tuple[str, ...]:
    """Where the limits come from, where they are not the campaign's own, or that none is of a parameter of ``past``.

    ``past`` is None where not all parameters were asked for.
    """
    name = tolerance_types(db).get(history.machine)
    if name is None:
        return ()
    without = () if past is None else limits_without_parameter(name, db.type_tolerances[name], past)
    if past is not None and {VOLUMETRIC, *past}.isdisjoint(db.type_tolerances[name]):
        return without
    return (messages.limits_of_type(name), *without)


def _simulated(db: Database, history: MachineHistory) -> tuple[str, ...]:
    """That nobody measured the readings, or some of them."""
    names = set(history.campaign.tolist())
    simulated = simulated_campaigns(db, names).get(history.machine, ())
    return (messages.simulated(simulated, len(names)),) if simulated else ()


def _refuted(refuted: ModelRefuted | None) -> tuple[str, ...]:
    """That readings refute the model, and what names what it lacks."""
    if refuted is None:
        return ()
    latest = refuted.campaigns[-1]
    names = tuple(campaign.campaign for campaign in refuted.campaigns)
    return (messages.model_refuted(names, refuted.judged, latest.model, latest.p_value),)


def _contradicted(
    db: Database, request: TrendRequest, history: MachineHistory
) -> ContradictedStatement | None:
    """The last run, where it contradicts what is stated of its readings and is among those that are shown."""
    contradicted = statements_contradicted(db, request.model, request.machine).get(request.machine)
    if contradicted is None:
        return None
    is_shown = (history.campaign == contradicted.campaign) & (history.run == contradicted.run)
    return contradicted if is_shown.any() else None


def _contradicting(contradicted: ContradictedStatement) -> str:
    """That the last run contradicts what is stated, and what looks for the reason."""
    return messages.statement_contradicted(contradicted.campaign, contradicted.run, contradicted.times)


def _calibrations(history: MachineHistory) -> Iterator[str]:
    """Which identifications do not say what their runs have of calibrations, and which calibrations are stated
    differently."""
    unstored = tuple(name for name in history.calibrations.unstored if (history.campaign == name).any())
    if unstored:
        yield calibration_messages.calibrations_not_stored(unstored)
    for first, second in stated_differently(history.common_parts):
        yield calibration_messages.stated_differently(
            first.of, first.certificate, first.quantity, calibrated_to(first), calibrated_to(second)
        )


def _not_followed(history: MachineHistory, refused: Mapping[str, str]) -> list[str]:
    """What is lacking, because it is not identified under the model that the machine is followed by."""
    if not history.unidentified:
        return []
    return [messages.not_identified_by_model(history.machine, history.unidentified, refused)]


def _of_older_version(db: Database, request: TrendRequest) -> list[str]:
    """Which version the values are of, where that is not the newest of a method's own model."""
    if request.model is not None:
        return []
    return [
        messages.numbers_of_older_version(
            request.machine, f"{older.model}@{older.version}", f"{older.model}@{older.newest}"
        )
        for older in older_numbers(db, request.machine)
    ]


def _why_none(request: TrendRequest) -> str:
    is_narrowed = (request.until, request.method, request.warm_up) != (None, None, None)
    return messages.no_identified_run(
        request.machine, request.campaigns, request.since, is_narrowed=is_narrowed
    )


def _next_check(history: MachineHistory, request: TrendRequest) -> float:
    """The next check in days since 1970: as named, or as far away as the campaigns lie apart."""
    last = history.seconds[-1] / SECONDS_PER_DAY
    if request.next_check is not None:
        check = days_since_1970(request.next_check)
        if check < last:
            raise InputError(
                f"--next-check {request.next_check.date()} lies before the last run, {history.started_at[-1].date()}"
            )
        return check
    # Runs are in the order of time: the first of a campaign that is met is its earliest.
    first = np.unique(history.campaign, return_index=True)[1]
    apart = np.diff(np.sort(history.seconds[first])) / SECONDS_PER_DAY
    return float(last + (np.median(apart) if len(apart) else NEXT_CHECK_D))


@dataclass(frozen=True)
class _Page:
    """What the parameters of one page share."""

    request: TrendRequest
    history: MachineHistory
    charts: Charts
    check: float
    between: Mapping[Change, OtherInstruments]

    def parameter(self, past: ParameterPast) -> ParameterTrend:
        """The long view of one parameter."""
        series, search, drift = past.series, past.search, past.drift
        effects, why_no_effects = conditions(series, self._channels(past), drift.begins)
        waves, why_no_waves = cycles(drift.piece)
        rng = np.random.default_rng([SEED, len(series.t)])
        warmth, why_no_warmth = warming(series, self.history.campaign[past.mask], search.changes, rng)
        test, why_no_test = backtested(drift)
        limit = self.history.tolerances.get(series.name)
        return ParameterTrend(
            unit=series.unit,
            drift=drift_statement(drift),
            mean=latest_mean(drift),
            changes=tuple(
                replace(
                    dated_change(
                        change, series, search.least_p, is_of_latest_day=past.is_of_latest_day(change)
                    ),
                    between_instruments=self.between.get(change),
                )
                for change in search.changes
            ),
            drifts=tuple(dated_change(change, series, search.least_p) for change in search.drifts),
            why_no_changes=search.why_none,
            conditions=effects,
            why_no_conditions=why_no_effects,
            cycles=waves,
            why_no_cycles=why_no_waves,
            warm_up=warmth,
            why_no_warm_up=why_no_warmth,
            forecast=limit_forecast(drift, limit, self.check, self.request.reliability),
            backtest=test,
            why_no_backtest=why_no_test,
            control=self.charts.of(self.history.parameters.index(series.name)),
            q_value=None,
            rests_on=calibrations(drift) or None,
        )

    def _channels(self, past: ParameterPast) -> dict[str, Array]:
        """The recorded conditions of the runs, not what instruments read. The method, with its instruments where setups
        name them, is one too: 1 for the runs of each but the first."""
        mask = past.mask
        channels = {name: values[mask] for name, values in self.history.true_conditions.items()}
        if len(set(self.history.measured_by.tolist())) > 1:
            method = self.history.measured_by[mask]
            for name in list(dict.fromkeys(method.tolist()))[1:]:
                channels[f"{METHOD}{name}"] = (method == name).astype(np.float64)
        return channels


def _with_event_steps(
    parameters: Mapping[str, ParameterTrend], steps: Sequence[EventStep]
) -> dict[str, ParameterTrend]:
    """The parameters with what each stepped by at recorded events."""
    return {
        name: replace(
            parameter,
            event_steps=tuple(
                StepAtEvent(
                    step.event.at.isoformat(), step.event.kind, step.event.description, step.size,
                    step.u, step.unit, step.p_value, "days" if step.by_days else "runs", step.decided,
                    step.undecided, step.drift,
                )
                for step in steps
                if step.parameter == name
            ),
        )
        for name, parameter in parameters.items()
    }  # fmt: skip
