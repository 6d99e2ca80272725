"""The changes of machines for the sheet `changes` of a workbook: what `trend` states, whether it was asked or not.

Changes and drifts of the search, and the steps at recorded events, at which the search never looks.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import UTC, datetime

from monitor import progress
from monitor.reporting import messages
from monitor.statistics import Change
from monitor.store import (
    ComputedChange,
    Database,
    MachineHistory,
    machine_events,
    machine_history,
    machines_with_runs,
    numbered_by,
)
from monitor.workflow.history.event_steps import EventStep, event_steps
from monitor.workflow.history.other_instruments import OtherInstruments, between_instruments
from monitor.workflow.history.past import ParameterPast, machine_past, splitting_events
from monitor.workflow.trend.parameter import dated_change


def workbook_changes(db: Database, machine: str | None) -> tuple[ComputedChange, ...]:
    """Search the identified runs of every machine, or of one, for changes; a row that says so where there is none.

    Nothing is identified or stored. Times are in UTC without an offset. Raises NotFoundError for an unknown machine.
    """
    machines = machines_with_runs(db) if machine is None else [machine]
    rows: list[ComputedChange] = []
    for number, name in enumerate(machines):
        history = machine_history(db, name, followed_by=numbered_by(db, name))
        events = machine_events(db, name)
        past = machine_past(history, splitting_events(events)) if len(history.run) else {}
        others = between_instruments(history, past, splitting_events(events))
        changes = [row for parameter in past.values() for row in _changes(name, others, parameter)]
        changes += [_at_event(name, step) for step in event_steps(past, events)]
        rows += changes
        if not changes and (past or not history.unidentified):
            rows.append(ComputedChange(name, None, "none", what=_why_none(past)))
        if history.unidentified:
            rows.append(ComputedChange(name, None, "not searched", what=_not_identified(history)))
        progress.told((number + 1) / len(machines))
    return tuple(rows)


def _changes(
    machine: str, between: Mapping[Change, OtherInstruments], past: ParameterPast
) -> Iterator[ComputedChange]:
    search = past.search
    for change in (*search.changes, *search.drifts):
        dated, others = dated_change(change, past.series), between.get(change)
        at = (
            None
            if dated.at is None
            else datetime.fromisoformat(dated.at).astimezone(UTC).replace(tzinfo=None)
        )
        yield ComputedChange(
            machine, at, dated.kind, past.series.name, dated.size, dated.u, dated.unit, dated.p_value,
            "; ".join(
                [
                    messages.change_in_words(dated.kind, change.kind == "trend" and past.is_maybe_season(change)),
                    *([] if others is None else [others.in_words(dated.unit)]),
                ]
            ),
        )  # fmt: skip


def _at_event(machine: str, step: EventStep) -> ComputedChange:
    """The step at an event; without a p-value where it is not decided, as `trend` says it in words."""
    return ComputedChange(
        machine, step.event.at.astimezone(UTC).replace(tzinfo=None), f"step at event: {step.event.kind}",
        step.parameter, step.size, step.u, step.unit, step.p_value if step.decided else None,
        messages.as_trend_computes(str(step.in_words)),
    )  # fmt: skip


def _why_none(past: dict[str, ParameterPast]) -> str:
    whys = {str(parameter.search.why_none) for parameter in past.values() if parameter.search.why_none}
    return messages.no_change(len(past), whys)


def _not_identified(history: MachineHistory) -> str:
    return messages.not_identified_by_model(history.machine, history.unidentified, {})
