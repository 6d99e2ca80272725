"""What the fleet table says of a machine: its state, since when, how likely it is out, and when to look again."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from monitor.documents import Said
from monitor.records import VOLUMETRIC, Verdict
from monitor.reporting.health.concern import DRIFT_P, drifting_without_limit, largest_shares, volumetric_binds
from monitor.reporting.health.news import (
    CheckKind,
    Drifting,
    ImportsRefused,
    ModelLacks,
    NewThisWeek,
    NextCheck,
)
from monitor.reporting.health.records import (
    ALARMS,
    Change,
    ChangeKind,
    DataQuality,
    ParameterHealth,
    RefusedImport,
    State,
    VolumetricMap,
)
from monitor.reporting.health.sentences import Factor, NoFactor
from monitor.statistics import control_false_discoveries
from monitor.uncertainty.conformity import conformity
from monitor.workflow.explain.explain_answer import MachineExplanation
from monitor.workflow.health.weeks import Week
from monitor.workflow.history.calendar import local_time
from monitor.workflow.history.forecast import DriftForecast
from monitor.workflow.history.past import ParameterPast
from monitor.workflow.uncertainty.answer import UncertaintyAnswer

#: So many sentences of a week are named one by one.
MOST_NAMED = 3
#: False discovery rate of drifts without a tolerance on one machine: that of changes (``docs/statistics.md``).
DRIFTING = 0.01


@dataclass(frozen=True)
class Conformity:
    """Probability of each parameter and of any of them to be out; None where no tolerance is stated."""

    single: Mapping[str, float]
    any: float | None
    every_has_one: bool


def conformity_of(stated: UncertaintyAnswer | None, limits: Mapping[str, float]) -> Conformity:
    """The parameters of a run against the limits of their absolute values."""
    if stated is None or not any(name in limits for name in stated.parameters):
        return Conformity({}, None, every_has_one=False)
    names = stated.parameters
    # Each parameter rests on its own part of the budget; an evaluation of before knows one number for all.
    every = stated.guf.degrees_of_freedom
    freedoms = stated.guf.degrees_of_freedom_by_parameter or dict.fromkeys(names, every)
    dof = [math.inf if (freedom := freedoms.get(name, every)) is None else freedom for name in names]
    limit = np.array([limits.get(name, np.inf) for name in names])
    result = conformity(
        [stated.guf.estimate[name] for name in names], stated.covariance, -limit, limit,
        dof=dof,
    )  # fmt: skip
    single = {name: float(1.0 - p) for name, p in zip(names, result.single, strict=True) if name in limits}
    return Conformity(single, float(1.0 - result.joint), all(name in limits for name in names))


def with_effects(
    judged: Conformity, pasts: Mapping[str, ParameterPast], added: Sequence[str], limits: Mapping[str, float]
) -> Conformity:
    """The judgement with that of the effects of the model that the last run has a value of; as it was without limits.

    An effect that is no output of the run's evaluation has its value and u from the history. The probability of any to
    be out is at most the sum, which is taken, as for the volumetric error.
    """
    judged_already = judged.single
    names = [name for name in added if name in limits and name not in judged_already and pasts[name].mask[-1]]
    if not names:
        return judged
    limit = np.array([limits[name] for name in names])
    series = [pasts[name].series for name in names]
    u = np.array([each.u[-1] for each in series])
    inside = conformity([each.values[-1] for each in series], np.diag(u**2), -limit, limit).single
    out = {name: float(1.0 - p) for name, p in zip(names, inside, strict=True)}
    any_out = min(1.0, (judged.any or 0.0) + sum(out.values()))
    return Conformity({**judged.single, **out}, any_out, judged.every_has_one)


def with_volumetric(judged: Conformity, probability_out: float | None) -> Conformity:
    """The judgement with that of the volumetric error beside it; as it was where there is none.

    The volumetric error is made of the same parameters. The probability of any to be out is at most the sum, which is
    taken: an alarm must not hide behind a correlation that nobody stored.
    """
    if probability_out is None:
        return judged
    single = {**judged.single, VOLUMETRIC: probability_out}
    return Conformity(single, min(1.0, (judged.any or 0.0) + probability_out), judged.every_has_one)


def new_this_week(
    noted: Sequence[Change],
    explanation: MachineExplanation | None,
    quality: DataQuality,
    drifting: tuple[Drifting, ...] = (),
) -> NewThisWeek:
    """What is new this week: changes, with those that are still open, then steps at events, then events,
    what the model lacks, and data that never came in; and what is ``drifting``."""
    every: list[Said] = [
        change.now
        for kind in (ChangeKind.CHANGE, ChangeKind.EVENT_STEP, ChangeKind.EVENT)
        for change in noted
        if change.kind is kind and (change.this_week or change.is_open)
    ]
    every += imports_refused(quality.refused_imports)
    missing = () if explanation is None else explanation.missing[:1]
    lacking = tuple(ModelLacks(effect.effect) for effect in missing)
    return NewThisWeek(tuple(every[:MOST_NAMED]), max(0, len(every) - MOST_NAMED), lacking, drifting)


def due_by_drift(state: State, check: NextCheck) -> str | None:
    """The parameter whose drift may have taken a machine out of tolerance with which nothing was wrong."""
    fine = state in (State.IN_TOLERANCE, State.NO_CHANGE_SEEN)
    return check.parameter if fine and check.kind is CheckKind.PASSED else None


def drifting_to_limit(
    state: State, parameters: Sequence[ParameterHealth], error_map: VolumetricMap | None, due: str | None
) -> tuple[Drifting, ...]:
    """The drifts that make the state of a machine, where they are not by chance; else nothing.

    That of the parameter which is out of tolerance or due; of a volumetric error those of what adds most to it.
    """
    if due is None and state not in (State.OUT_OF_TOLERANCE, State.MAY_BE_OUT_OF_TOLERANCE):
        return ()
    if due is None and error_map is not None and volumetric_binds(state, parameters, error_map):
        by_name = {each.name: each for each in parameters}
        names = [share.parameter for share in largest_shares(error_map)]
        return tuple(
            _drifting(by_name[name]) for name in names if name in by_name and _is_seen(by_name[name])
        )
    judged = [each for each in parameters if each.name == due or (due is None and each.probability_out)]
    worst = max(judged, key=lambda each: each.probability_out or 0.0, default=None)
    return () if worst is None or not _is_seen(worst) else (_drifting(worst),)


def drifting_unjudged(parameters: Sequence[ParameterHealth]) -> tuple[Drifting, ...]:
    """The drifts that no tolerance judges and that are beyond chance, the surest first.

    False discoveries among all drifts of the machine are controlled at ``DRIFTING``: of a machine on which nothing
    drifts one is named with that probability, as for changes.
    """
    p_values = [each.drift.p_value for each in parameters if each.drift is not None]
    if not p_values:
        return ()
    q_value = control_false_discoveries(np.array(p_values), rate=DRIFTING).q_value
    q_of = dict(zip((each.name for each in parameters if each.drift is not None), q_value, strict=True))
    return tuple(_drifting(each) for each in drifting_without_limit(parameters) if q_of[each.name] < DRIFTING)


def drifting_named(to_limit: tuple[Drifting, ...], unjudged: tuple[Drifting, ...]) -> tuple[Drifting, ...]:
    """Return the drifts that are named of a machine: those that make its state, then the surest that nothing judges."""
    return to_limit + tuple(drifting for drifting in unjudged if drifting not in to_limit)[:MOST_NAMED]


def _is_seen(parameter: ParameterHealth) -> bool:
    """Whether a parameter has a drift that is not by chance."""
    return parameter.drift is not None and parameter.drift.p_value < DRIFT_P


def _drifting(parameter: ParameterHealth) -> Drifting:
    drift = parameter.drift
    assert drift is not None
    return Drifting(
        parameter.name, drift.per_year, drift.u_per_year, parameter.unit, bool(drift.season_not_told)
    )


def imports_refused(refused: Sequence[RefusedImport]) -> tuple[ImportsRefused, ...]:
    """One sentence for the imports that were refused and did not come in since."""
    open_refusals = [refusal for refusal in refused if refusal.imported_at is None]
    return (ImportsRefused(len(open_refusals), open_refusals[-1].at),) if open_refusals else ()


def since_when(
    state: State,
    parameters: Sequence[ParameterHealth],
    noted: Sequence[Change],
    failing: datetime,
    due: str | None = None,
) -> datetime | None:
    """Since when the machine is in this state: beyond a tolerance, another one than before, or not explained by the
    model, ``failing`` from the first of the compared runs that show it; drifting, or ``due`` by the drift of a
    parameter, from the first run that shows it."""
    if due is not None:
        drift = {each.name: each.drift for each in parameters}.get(due)
        return None if drift is None else drift.since
    beyond = [parameter.out_since for parameter in parameters if parameter.out_since is not None]
    if state in ALARMS:
        # Of the volumetric error there is no value run by run: no day is better than a wrong one.
        return min(beyond, default=None)
    if state is State.MODEL_FAILS:
        return failing
    if state is State.DRIFTS:
        surest = drifting_without_limit(parameters)[0].drift
        return None if surest is None else surest.since
    changed = [change for change in noted if change.kind is ChangeKind.CHANGE]
    if state is State.CHANGED:
        return min(change.at for change in changed if change.counts)
    return max((change.at for change in changed), default=None)


def state_of(
    judged: Conformity,
    noted: Sequence[Change],
    explanation: MachineExplanation | None,
    quality: DataQuality,
    risk: float,
    *,
    evaluated: bool,
    drifts: bool = False,
) -> State:
    """The most urgent state that holds; ``evaluated``: whether the last run has the results that its method gives.

    ``drifts``: whether a parameter without a tolerance drifts. A step of an earlier week that is still open comes after
    a model that fails.
    """
    if judged.any is not None and max(judged.single.values()) > 0.5:
        return State.OUT_OF_TOLERANCE
    if judged.any is not None and judged.any > risk:
        return State.MAY_BE_OUT_OF_TOLERANCE
    if not evaluated:
        return State.NOT_EVALUATED
    counting = [change for change in noted if change.counts]
    if any(change.this_week for change in counting):
        return State.CHANGED
    if explanation is not None and explanation.comparison.verdict is Verdict.SOMETHING_IS_MISSING:
        return State.MODEL_FAILS
    if counting:
        return State.CHANGED
    if drifts:
        return State.DRIFTS
    if quality.suspect:
        return State.SUSPECT_DATA
    return State.IN_TOLERANCE if judged.every_has_one else State.NO_CHANGE_SEEN


def next_check(
    state: State,
    drifts: Mapping[str, DriftForecast | None],
    limits: Mapping[str, float],
    week: Week,
    of_one_day: str | None = None,
) -> NextCheck:
    """When to measure again, and why: the machine is likely to be in tolerance until then.

    ``of_one_day`` names a parameter that stepped before the latest day of the week, None without one.
    """
    good_until = {
        name: drift.origin + drift.good_for
        for name, drift in drifts.items()
        if drift is not None and drift.good_for is not None
    }
    if state is State.NOT_EVALUATED:
        return NextCheck(CheckKind.NOT_EVALUATED)
    if state in ALARMS:
        return NextCheck(CheckKind.ALARM)
    if of_one_day is not None:
        kind = CheckKind.ONE_DAY if limits else CheckKind.ONE_DAY_NO_TOLERANCE
        return NextCheck(kind, of_one_day)
    if not limits:
        return NextCheck(CheckKind.NO_TOLERANCE)
    if not good_until:
        return NextCheck(CheckKind.NO_FORECAST)
    name = min(good_until, key=good_until.__getitem__)
    first = drifts[name]
    assert first is not None
    until = local_time(good_until[name], first.offset)
    assert until is not None
    day, whole = until.date(), first.good_for == first.span
    if whole and day <= week.last:
        return NextCheck(CheckKind.SHORT_HISTORY, name, day, first.span)
    if day <= week.last:
        return NextCheck(CheckKind.PASSED, name, day, first.span)
    return NextCheck(
        CheckKind.AS_FAR_AS_HISTORY if whole else CheckKind.IN_TOLERANCE_UNTIL, name, day, first.span
    )


def factor_of(stated: UncertaintyAnswer | None) -> Factor | NoFactor:
    """What the expanded uncertainties of the page hold for."""
    if stated is None:
        return NoFactor()
    k_q = stated.guf.k_q_with_degrees_of_freedom
    k_q = math.inf if k_q is None else k_q
    return Factor(k_q, len(stated.parameters), stated.p, stated.guf.degrees_of_freedom)
