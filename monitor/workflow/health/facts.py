"""What stands on a machine's page of the health report, put together from its past and from stored results."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np

from monitor.documents import Said
from monitor.methods import method_named
from monitor.reporting.frames import referred
from monitor.reporting.health.news import BallMoved, EventNoted, ParameterChanged
from monitor.reporting.health.records import (
    Change,
    ChangeKind,
    ConditionRange,
    DataQuality,
    History,
    ParameterHealth,
    RefusedImport,
)
from monitor.reporting.health.sentences import BadPoint, ScatteringBall, StepFailed
from monitor.reporting.health.settling import ParameterSettled
from monitor.reporting.messages import ONE_DAY
from monitor.reporting.symbols import describe
from monitor.reporting.texts import texts_of
from monitor.statistics import Change as FoundChange
from monitor.store import Database, MachineEvent, MachineHistory, RecordedRun, campaign_notes, probing_counts
from monitor.units import COLUMN_UNITS
from monitor.workflow.explain.explain_answer import ChangedParameter, MachineExplanation, MovedTarget
from monitor.workflow.health.forecast import stated_drift
from monitor.workflow.health.weeks import Week
from monitor.workflow.history.calendar import local_time
from monitor.workflow.history.event_steps import EventStep
from monitor.workflow.history.forecast import DriftForecast
from monitor.workflow.history.other_instruments import OtherInstruments, between_instruments
from monitor.workflow.history.past import ParameterPast, splitting_events
from monitor.workflow.history.series import Series
from monitor.workflow.uncertainty.answer import UncertaintyAnswer

#: For so long a step that no event explains is said of a machine every week.
OPEN_FOR = timedelta(weeks=13)


@dataclass(frozen=True)
class Judgement:
    """A parameter against its tolerance: the probability to be beyond it, and the drift foretold."""

    tolerance: float | None
    probability_out: float | None
    ahead: DriftForecast | None


def parameter_health(
    past: ParameterPast,
    starts: Sequence[datetime],
    stated: UncertaintyAnswer,
    judgement: Judgement,
    week: Week,
    in_words: str,
) -> ParameterHealth:
    """One parameter of the page; ``starts`` are the local starts of the runs that have it, ``in_words`` its name."""
    series, tolerance = past.series, judgement.tolerance
    name, values = series.name, series.values
    beyond = None
    if tolerance is not None and abs(values[-1]) > tolerance:
        inside = np.flatnonzero(np.abs(values) <= tolerance)
        beyond = starts[int(inside[-1]) + 1 if inside.size else 0]
    estimate, u, expanded = _stated(series, stated)
    return ParameterHealth(
        name=name,
        description=referred(in_words or describe(name), (stated.frames or {}).get(name), texts_of()),
        unit=series.unit,
        estimate=estimate,
        u=u,
        expanded=expanded,
        tolerance=tolerance,
        probability_out=judgement.probability_out,
        out_since=beyond,
        history=History(
            tuple(starts),
            tuple(values.tolist()),
            tuple(series.u.tolist()),
            tuple(week.holds(start) for start in starts),
        ),
        changed_at=tuple(moment_of(change.at, series) for change in past.search.changes),
        # Scatter of a few days, stated a year, would only mislead.
        drift=stated_drift(past.drift, judgement.ahead),
        in_words=in_words,
    )


def _stated(series: Series, stated: UncertaintyAnswer) -> tuple[float, float, float]:
    """Estimate, u and U of a parameter: as evaluated, or of an effect added to the model as its last run gives it."""
    name = series.name
    if name in stated.units:
        return stated.guf.estimate[name], stated.guf.u[name], stated.guf.expanded[name]
    u, k_q = float(series.u[-1]), stated.guf.k_q_with_degrees_of_freedom
    return float(series.values[-1]), u, math.inf if k_q is None else k_q * u


def moment_of(t: float, series: Series) -> datetime:
    """A time of a series (days since 1970) by the shop's clock."""
    moment = local_time(t, series.offset)
    assert moment is not None
    return moment


def changes_noted(
    history: MachineHistory,
    past: Mapping[str, ParameterPast],
    events: Sequence[MachineEvent],
    steps: Sequence[EventStep],
    explanation: MachineExplanation | None,
    runs: Sequence[RecordedRun],
    week: Week,
) -> list[Change]:
    """Everything that changed, the latest first; ``runs`` are those of the campaign that was explained."""
    moments = splitting_events(events)
    noted: list[Change] = []
    between = between_instruments(history, past, moments)
    for parameter in past.values():
        noted += _found_changes(parameter, moments, between, week)
        noted += _settling(parameter, week)
    for step in steps:
        at = step.event.at.replace(tzinfo=None)
        noted.append(Change(ChangeKind.EVENT_STEP, None, at, step.in_words, step.p_value, week.holds(at)))
    starts = {run.run: run.local_start for run in runs}
    for move in () if explanation is None else explanation.changes:
        if not isinstance(move, ChangedParameter) and move.run in starts:
            target = "" if isinstance(move, MovedTarget) and move.of_all else move.target
            moved, at = BallMoved(target, move.size, move.unit, move.run), starts[move.run]
            noted.append(Change(ChangeKind.CHANGE, None, at, moved, move.p_value, week.holds(at)))
    noted += [event_noted(event, week) for event in events]
    return sorted(noted, key=lambda change: change.at, reverse=True)


def _found_changes(
    parameter: ParameterPast,
    events: Sequence[float],
    between: Mapping[FoundChange, OtherInstruments],
    week: Week,
) -> Iterator[Change]:
    """Yield the changes of a parameter that the search found."""
    remaining = not_put_right(parameter.search.changes)
    for change in parameter.search.changes:
        at = moment_of(change.at, parameter.series)
        after = moment_of(change.interval[0], parameter.series)
        others, unit = between.get(change), parameter.series.unit
        besides = [] if others is None else [others.in_words(unit)]
        if parameter.is_of_latest_day(change):
            besides.append(ONE_DAY)
        what = ParameterChanged(
            change.parameter, change.kind, change.size, change.u, unit, "; ".join(besides)
        )
        is_explained = any(event >= change.interval[0] for event in events) or (
            others is not None and others.may_be_all
        )
        is_open = change in remaining and not is_explained and timedelta() < week.begins - at <= OPEN_FOR
        yield Change(ChangeKind.CHANGE, after, at, what, change.p_value, week.holds(at), is_open or None)


def not_put_right(changes: Sequence[FoundChange]) -> list[FoundChange]:
    """The steps of one parameter, in the order of time, that no others undid: not one of several steps that come to
    less than half of it together."""
    steps = [change for change in changes if change.kind == "step"]
    level = np.cumsum([0.0, *(step.size for step in steps)])
    return [
        step
        for i, step in enumerate(steps)
        if not any(
            abs(level[after] - level[before]) < 0.5 * abs(step.size)
            for before in range(i + 1)
            for after in range(i + 1, len(level))
        )
    ]


def _settling(parameter: ParameterPast, week: Week) -> Iterator[Change]:
    """Yield the changes of a parameter that pass again."""
    series = parameter.series
    for change in parameter.search.drifts:
        if change.time_constant is not None:
            at = moment_of(change.at, series)
            what = ParameterSettled(series.name, change.size, change.u, series.unit, change.time_constant)
            yield Change(ChangeKind.SETTLING, None, at, what, change.p_value, week.holds(at))


def event_noted(event: MachineEvent, week: Week) -> Change:
    """An event as the page states it."""
    at = event.at.replace(tzinfo=None)
    what = EventNoted(event.kind, event.description)
    return Change(ChangeKind.EVENT, None, at, what, None, week.holds(at))


def condition_ranges(runs: Sequence[RecordedRun]) -> tuple[ConditionRange, ...]:
    """Every recorded condition over the runs of the week."""
    ranges = []
    for name in sorted({name for run in runs for name in run.conditions}):
        stem, _, suffix = name.rpartition("_")
        unit = COLUMN_UNITS.get(suffix) if stem else None
        values = [run.conditions[name] for run in runs if name in run.conditions]
        title = (stem if unit else name).replace("_", " ")
        ranges.append(
            ConditionRange(title, unit.name if unit else "", min(values), float(np.mean(values)), max(values))
        )
    return tuple(ranges)


def _suspect(
    explanation: MachineExplanation, measured: Collection[tuple[str, int]], row_word: str
) -> Iterator[ScatteringBall | BadPoint]:
    """Targets that scatter, and bad points, in the ``measured`` runs (campaign, run); a row of the method is called
    ``row_word``."""
    campaign = explanation.comparison.campaign
    if any(name == campaign for name, _ in measured):
        for each in explanation.scattering:
            yield ScatteringBall(each.target, each.times, each.deviation_um, explanation.target_word)
    for point in explanation.suspect_data:
        if (campaign, point.run) in measured:
            yield BadPoint(
                point.run,
                point.sequence,
                point.target,
                point.axis,
                point.size_um,
                row_word,
                explanation.target_word,
            )


def data_quality(
    db: Database,
    runs: Sequence[RecordedRun],
    explanation: MachineExplanation | None,
    stated: UncertaintyAnswer | None,
    refused_imports: tuple[RefusedImport, ...],
    remarks: Sequence[Said],
) -> DataQuality:
    """What the data of the week's ``runs`` are worth; without a result, what depends on it is empty. The remarks begin
    with what was refused: the first of them says why a machine is not evaluated."""
    campaigns = sorted({run.campaign for run in runs})
    counts = {name: probing_counts(db, name) for name in campaigns}
    noticed = [note for name in campaigns for note in campaign_notes(db, name)]
    measured = {(run.campaign, run.run) for run in runs}
    suspect: tuple[ScatteringBall | BadPoint, ...] = ()
    if explanation is not None:
        rows = {run.campaign: method_named(run.method).nouns.row for run in runs}
        suspect = tuple(_suspect(explanation, measured, rows.get(explanation.comparison.campaign, "reading")))
    return DataQuality(
        runs=len(runs),
        probings=sum(counts[campaign].get(run, 0) for campaign, run in measured),
        warm_up_runs=sum(run.warm_up for run in runs),
        suspect=suspect,
        refused=()
        if stated is None
        else tuple((", ".join(group.parameters), group.why) for group in stated.refused),
        blind_spots=() if explanation is None else explanation.blind_spots,
        remarks=tuple(sorted((*noticed, *remarks), key=lambda said: not isinstance(said, StepFailed))),
        refused_imports=refused_imports,
    )
