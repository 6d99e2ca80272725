"""Answers, for the first page, the six questions of someone who runs the shop: one sentence each, from the records."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from monitor.reporting.adjusting import SEE_FIRST, adjusting
from monitor.reporting.health.change_first import change_first
from monitor.reporting.health.comparison import CHECK_STATEMENT, MissingEffect
from monitor.reporting.health.concern import (
    DRIFT_P,
    binding_shares,
    concern,
    likeliest_out,
    out_of_tolerance,
    volumetric_binds,
)
from monitor.reporting.health.news import CheckKind, NextCheck
from monitor.reporting.health.records import (
    ALARMS,
    STATES,
    Drift,
    Fleet,
    FleetRow,
    MachineHealth,
    MapShare,
    ParameterHealth,
    State,
    is_due,
)
from monitor.reporting.health.words import day, in_words, percent, plain
from monitor.reporting.messages import DRIFT_OR_SEASON

#: States in which a machine wants something done; in the others nothing is wrong, or nothing is known.
URGENT: tuple[State, ...] = tuple(list(STATES)[: list(STATES).index(State.SUSPECT_DATA) + 1])
#: States in which nothing is wrong.
FINE: tuple[State, ...] = (State.IN_TOLERANCE, State.NO_CHANGE_SEEN)
#: States of machines that were measured and evaluated, but need not have had a tolerance to be judged by.
_WITHOUT_LIMIT: tuple[State, ...] = (
    State.MODEL_FAILS,
    State.CHANGED,
    State.DRIFTS,
    State.SUSPECT_DATA,
    State.NO_CHANGE_SEEN,
)
#: Names of machines in a sentence, and of parameters that are out of tolerance; of more, their number.
_NAMED, _OUT_NAMED = 6, 3
_QUIET = "No parameter is out of its tolerance, none changed, and the models explain the measurements."
_QUIET_IN_PART = (
    "No parameter that has a tolerance is out of it (not every one has), none changed, and the models explain the "
    "measurements."
)
_QUIET_WITHOUT = "No parameter changed, and the models explain the measurements; no tolerances are stated."
_QUIET_UNCERTAIN = (
    "No parameter changed, and the models explain the measurements; without uncertainties nothing is held against the "
    "tolerances."
)
_AS_PLANNED = "Measure again as planned."
_UNMEASURED = "No machine was measured this week, so nothing is known of its state."
_NOTICED = "No parameter is out of its tolerance, but weekly looks noticed a change: see below the table."


@dataclass(frozen=True)
class AnsweredQuestion:
    """A question, its ``kind`` (the same in every report) and the sentence that answers it."""

    kind: str
    question: str
    sentence: str


def answers(fleet: Fleet) -> tuple[AnsweredQuestion, ...]:
    """Return the answers of a week in the order in which they are asked."""
    worst = next((health for health in fleet.attention if health.state in URGENT), None)
    return (
        AnsweredQuestion("worst", "Worst machine?", _worst(fleet)),
        AnsweredQuestion("why", "Why?", _quiet(fleet) if worst is None else reason(worst)),
        AnsweredQuestion("since", "Since when?", "Nothing to date." if worst is None else _since(worst)),
        AnsweredQuestion(
            "do", "What to do?", _with_due(_keep_on(fleet) if worst is None else to_do(worst), fleet.rows)
        ),
        AnsweredQuestion("fine", "What is fine?", _fine(fleet.rows)),
        AnsweredQuestion("unjudged", "Not judged?", _unjudged(fleet)),
    )


def _quiet(fleet: Fleet) -> str:
    """Why no machine is the worst; only of what was measured, and only of tolerances that are stated."""
    states = {row.state for row in fleet.rows}
    if fleet.noticed:
        return _NOTICED
    if not states & set(FINE):
        return _UNMEASURED
    if not any(_was_judged(row) for row in fleet.rows):
        checked = [row for row in fleet.rows if row.state in FINE]
        return _QUIET_UNCERTAIN if any(map(_has_tolerances, checked)) else _QUIET_WITHOUT
    return _QUIET_IN_PART if State.NO_CHANGE_SEEN in states else _QUIET


def reason(health: MachineHealth) -> str:
    """Return why a machine is in its state, in plain words with numbers."""
    reason = _REASONS.get(health.state, _nearest_limit)(health)
    return _sentence(reason or STATES[health.state])


def _out(health: MachineHealth) -> str:
    """What is beyond its tolerance, or may be: a parameter, the volumetric error, or both."""
    parameter, error_map, sentences = likeliest_out(health), health.map, []
    if parameter is not None and parameter.probability_out:
        sentences.append(_beyond(parameter))
    others = [each for each in out_of_tolerance(health) if each is not parameter]
    if others:
        sentences.append(
            f"also out of tolerance: {_counted([_stands_short(each) for each in others], _OUT_NAMED - 1)}"
        )
    if error_map is not None and error_map.probability_out and error_map.limit_um is not None:
        sentences.append(
            f"the volumetric error reaches {error_map.worst_um:.1f} µm, its limit is "
            f"{plain(error_map.limit_um)} µm (beyond it with a probability of {percent(error_map.probability_out)})"
        )
    shares = binding_shares(health)
    if shares:
        sentences.append(f"most of it comes from {_shares(health, shares)}")
    sentences += [
        f"{parameter.name} {moves.removeprefix(' and ')}"
        for share in shares
        for parameter in health.parameters
        if parameter.name == share.parameter and parameter.drift is not None
        if (moves := _moves(parameter, parameter.drift))
    ]
    missing = _first_missing(health)
    if missing is not None and health.state in (State.OUT_OF_TOLERANCE, State.MAY_BE_OUT_OF_TOLERANCE):
        sentences.append(
            f"the model lacks {missing.meaning} ({missing.effect}), and its lack of fit is part of what is uncertain"
        )
    return "; ".join(sentences)


def _shares(health: MachineHealth, shares: Sequence[MapShare]) -> str:
    """Parameters with what each adds to the worst volumetric error."""
    name_of = {parameter.name: f"{parameter.in_words} ({parameter.name}" for parameter in health.parameters}
    return ", ".join(
        f"{name_of.get(share.parameter, f'({share.parameter}')}, {share.error_um:+.1f} µm)"
        for share in shares
    )


def _first_missing(health: MachineHealth) -> MissingEffect | None:
    """The effect that the model of a machine lacks most; None where it lacks none."""
    return next(iter(() if health.model is None else health.model.missing), None)


def _not_evaluated(health: MachineHealth) -> str:
    return "; ".join(map(str, health.quality.remarks[:1]))


#: What to do where work points come out elsewhere than the file states them.
LOOK_AT_FILE = (
    "Look at the work points and the axes' signs, units and columns in campaign.toml, and import the campaign again "
    "once they are right."
)


def _unexplained(health: MachineHealth) -> str:
    return "" if health.model is None else health.model.unexplained


def _changed(health: MachineHealth) -> str:
    changes = [change for change in health.changes if change.counts]
    parameter = concern(health)
    name = ""
    if parameter is not None and any(change.at in parameter.changed_at for change in changes):
        name = f" ({parameter.in_words})"
    return "; ".join(str(change.now) for change in changes) + name


def _suspect(health: MachineHealth) -> str:
    suspect = health.quality.suspect
    if not suspect:
        return ""
    return f"{suspect[0]}{f', and {len(suspect) - 1} more' if len(suspect) > 1 else ''}"


def _nearest_limit(health: MachineHealth) -> str:
    """The parameter that drifts, where one does."""
    parameter = concern(health)
    if parameter is None or parameter.drift is None:
        return ""
    moves = _moves(parameter, parameter.drift)
    return f"{_stands(parameter)}{moves}" if moves or is_due(health) else ""


#: What says why a machine is in a state; of the others, what drifts.
_REASONS: Mapping[State, Callable[[MachineHealth], str]] = {
    State.OUT_OF_TOLERANCE: _out,
    State.MAY_BE_OUT_OF_TOLERANCE: _out,
    State.NOT_EVALUATED: _not_evaluated,
    State.MODEL_FAILS: _unexplained,
    State.CHANGED: _changed,
    State.SUSPECT_DATA: _suspect,
}


def _beyond(parameter: ParameterHealth) -> str:
    drift = "" if parameter.drift is None else _moves(parameter, parameter.drift)
    out = percent(parameter.probability_out or 0.0)
    return f"{_stands(parameter)}{drift}; out of tolerance with a probability of {out}"


def _stands_short(parameter: ParameterHealth) -> str:
    value, _ = in_words(parameter.estimate, parameter.expanded, sign=True)
    limit = plain(parameter.tolerance or 0.0)
    return f"{parameter.in_words} ({parameter.name}: {value} {parameter.unit}, tolerance ± {limit})"


def _stands(parameter: ParameterHealth) -> str:
    value, expanded = in_words(parameter.estimate, parameter.expanded, sign=True)
    limit = "" if parameter.tolerance is None else f", tolerance ± {plain(parameter.tolerance)}"
    name = parameter.in_words
    return f"{name} ({parameter.name}) is {value} {parameter.unit} (U = {expanded}{limit})"


def _moves(parameter: ParameterHealth, drift: Drift) -> str:
    """How much the parameter gets further from zero (grows) or nearer to it a month, where that is no chance."""
    if drift.p_value >= DRIFT_P:
        return ""
    month, _ = in_words(abs(drift.per_year) / 12.0, drift.u_per_year / 12.0)
    verb = "grows" if drift.per_year * parameter.estimate > 0.0 else "shrinks"
    sentence = f" and {verb} by {month} {parameter.unit} a month"
    last = parameter.history.times[-1].date()
    if verb == "grows" and drift.crosses_at is not None and drift.crosses_at > last:
        sentence += f", so that it reaches its tolerance about {drift.crosses_at}"
    return f"{sentence} ({DRIFT_OR_SEASON})" if drift.season_not_told else sentence


def _since(health: MachineHealth) -> str:
    if health.since is None:
        return "Not known: this is not stated run by run."
    if health.state in ALARMS:
        return f"{_beyond_since(health, health.since)}: every run since then lies beyond the tolerance."
    if health.state is State.MODEL_FAILS:
        return f"Since {day(health.since)} at the latest, the first of the compared runs that show it."
    if health.due is not None or health.state is State.DRIFTS:
        return f"Since {day(health.since)} at the latest, the first of the runs that show it."
    span = next(
        (change.after for change in health.changes if change.counts and change.at == health.since),
        None,
    )
    if span is not None and span != health.since:
        return f"Between {day(span)} and {day(health.since)}."
    return f"Since {day(health.since)}."


def _beyond_since(health: MachineHealth, since: datetime) -> str:
    """Since when each of the parameters that are named lies beyond its tolerance; one day where it is the same."""
    named = [each for each in out_of_tolerance(health)[:_OUT_NAMED] if each.out_since is not None]
    days = {day(each.out_since) for each in named if each.out_since is not None} or {day(since)}
    if len(days) == 1:
        return f"Since {days.pop()}"
    return "Since " + ", ".join(f"{day(each.out_since)} ({each.name})" for each in named if each.out_since)


def to_do(health: MachineHealth) -> str:
    """Return what to do on a machine, begun with what changed in the week, and by when to measure it again."""
    parameter = concern(health)
    name = "its errors" if parameter is None else _named(parameter)
    out = [_named(each) for each in out_of_tolerance(health)]
    wrong, judged = (_counted(out, _OUT_NAMED) if parameter is not None and out else name), name
    if volumetric_binds(health.state, health.parameters, health.map):
        shares, judged = binding_shares(health), "the volumetric error"
        wrong = (
            _shares(health, shares) if shares else "what makes the volumetric error (monitor map names it)"
        )
    action = {
        State.OUT_OF_TOLERANCE: _adjusting(health, f"adjust or compensate {wrong} and measure again"),
        State.MAY_BE_OUT_OF_TOLERANCE: f"measure again with more runs: {judged} is too near its limit to be judged",
        State.DRIFTS: _adjusting(
            health, f"state a tolerance for {name}, or compensate it; measure again as planned"
        ),
        State.NOT_EVALUATED: "mend what its page names and measure again",
        State.CHANGED: "find out what was done or happened then, record it as an event, and measure again",
        State.SUSPECT_DATA: "look at the points that its page names and measure again",
        State.NOT_MEASURED: "measure it",
    }.get(health.state, "measure again as planned")
    missing = _first_missing(health)
    if _fails_by_file(health):
        return LOOK_AT_FILE
    if health.state in (State.MODEL_FAILS, State.MAY_BE_OUT_OF_TOLERANCE) and missing is not None:
        # More runs would not help: what the model lacks is what is uncertain.
        action = f"{missing.remedy.rstrip('.')}; then measure again"
    elif health.state is State.MODEL_FAILS and health.model is not None:
        action = "look at its page for where the model fails, and measure again"
        if health.model.times_stated is not None:
            action = f"see whether {CHECK_STATEMENT}; else {action}"
    elif SEE_FIRST in action:
        return _sentence(change_first(health, action))
    elif is_due(health):
        return _sentence(change_first(health, f"measure it again {_after_colon(str(health.next_check))}"))
    return _sentence(change_first(health, f"{action} {_when(health)}"))


def _fails_by_file(health: MachineHealth) -> bool:
    """Whether what fails is the file: the same plan would give the same."""
    return (
        health.state is State.MODEL_FAILS
        and health.model is not None
        and health.model.work_points_elsewhere is not None
    )


def _when(health: MachineHealth) -> str:
    if health.state in ALARMS and health.state is not State.NOT_EVALUATED:
        return "now"
    return f"(next check: {_after_colon(str(health.next_check))})"


def _named(parameter: ParameterHealth) -> str:
    return f"{parameter.in_words} ({parameter.name})"


def _adjusting(health: MachineHealth, action: str) -> str:
    """What adjusts by the values of a machine, or what comes before it; with the command that says what is missing."""
    model = health.model
    if model is None:
        return action
    missing = _first_missing(health)
    action = adjusting(action, is_doubted=model.is_doubted, remedy="" if missing is None else missing.remedy)
    return f"{action} (monitor explain {model.campaign})" if action == SEE_FIRST else action


def _after_colon(check: str) -> str:
    """When to check next, as it stands behind a colon: its own becomes a comma."""
    return check.replace(": ", ", ", 1)


def _worst(fleet: Fleet) -> str:
    urgent = [row for row in fleet.rows if row.state in URGENT]
    if all(row.state is State.NOT_MEASURED for row in fleet.rows):
        return "Not known: no machine was measured this week."
    if not urgent:
        return "None: no machine that was measured needs attention."
    first, *others = urgent
    location = f" ({first.location})" if first.location else ""
    more = f"; also {_names(others)}" if others else ""
    if (
        any(row.state is first.state and not row.probability_out for row in others)
        and not first.probability_out
    ):
        more += f" (no tolerance says which with {first.state} is the worst)"
    return f"{first.machine}{location}: {first.state}{more}."


def _keep_on(fleet: Fleet) -> str:
    checked = next((row for row in fleet.rows if row.state in FINE), None)
    return "Measure the machines that were not measured." if checked is None else _AS_PLANNED


def _with_due(action: str, rows: Sequence[FleetRow]) -> str:
    """What to do, with the machines that their drift may have taken out of tolerance since they were measured."""
    due = [row for row in rows if is_due(row)]
    if not due:
        return action
    why = f" ({_after_colon(str(due[0].next_check)).removeprefix('now, ')})" if len(due) == 1 else ""
    if action == _AS_PLANNED:
        return f"Measure again now: {_names(due)}{why}; the others as planned."
    return f"{action.removesuffix('.')}; measure again now as well: {_names(due)}{why}."


def _fine(rows: Sequence[FleetRow]) -> str:
    fine = [row for row in rows if row.state in FINE and not is_due(row)]
    if not fine:
        return "No machine could be stated to be fine."
    return f"{len(fine)} of {len(rows)} machine{'s' if len(rows) != 1 else ''}: {_names(fine)}."


def _was_judged(row: FleetRow) -> bool:
    """Whether a machine was judged by a tolerance; one that is in tolerance was, whatever else is stored of it."""
    return row.probability_out is not None or row.state in (State.IN_TOLERANCE, *ALARMS[:2])


def _has_tolerances(row: FleetRow) -> bool:
    """Whether tolerances are stated for a machine: then its next check is not open for the lack of them."""
    return isinstance(row.next_check, NextCheck) and row.next_check.kind not in (
        CheckKind.NO_TOLERANCE, CheckKind.ONE_DAY_NO_TOLERANCE,
    )  # fmt: skip


def _unjudged(fleet: Fleet) -> str:
    if not fleet.rows and not fleet.refused_imports:
        return "Nothing was there to judge: no machines yet."
    open_rows = [row for row in fleet.rows if row.state in _WITHOUT_LIMIT and not _was_judged(row)]
    parts = [
        f"{phrase}: {_names(rows)}"
        for state, phrase in (
            (State.NOT_MEASURED, "not measured this week"),
            (State.NOT_EVALUATED, "measured but not evaluated"),
            (State.NO_CHANGE_SEEN, "not every parameter has a tolerance"),
        )
        if (rows := [row for row in fleet.rows if row.state == state and row not in open_rows])
    ]
    if fleet.refused_imports:
        parts.append(f"{len(fleet.refused_imports)} refused imports of machines not known here")
    parts = _without_judgement(open_rows, parts, sum(map(_was_judged, fleet.rows)))
    return _sentence("; ".join(parts)) if parts else "Everything was judged."


def _without_judgement(rows: Sequence[FleetRow], parts: list[str], judged: int) -> list[str]:
    """The parts of the answer with that of the ``rows`` that were held against no tolerance, beside so many judged."""
    without = [row for row in rows if not _has_tolerances(row)]
    uncertain = [row for row in rows if _has_tolerances(row)]
    if uncertain:
        parts = [*parts, f"not against the tolerances stated, for want of uncertainties: {_names(uncertain)}"]
    if without and not judged and not uncertain:
        return ["nothing was judged: no tolerances are stated", *parts]
    if without:
        counted = f"{len(without)} of {len(rows) + judged} machines evaluated"
        return [*parts, f"no tolerances are stated for {counted}: {_names(without)}"]
    return parts


def _names(rows: Sequence[FleetRow]) -> str:
    return first_names([row.machine for row in rows])


def first_names(machines: Sequence[str]) -> str:
    """Return the first names of machines as a sentence names them, and how many more there are."""
    return _counted(machines, _NAMED)


def _counted(names: Sequence[str], most: int) -> str:
    """Return the first ``most`` of the names, and how many more there are."""
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")


def _sentence(text: str) -> str:
    """A text with a capital at the beginning, unless that is a symbol or a name, and a full stop."""
    head = text[:1].upper() + text[1:]
    return head if head.endswith(".") else head + "."
