"""What weekly looks at the whole fleet noticed: the one answer that report, trend page and fleet table give.

The past of every machine is gone through week by week, as if each week had been looked at when it ended: the same runs
give the same notices, whoever asks. Runs that are imported, withdrawn or identified otherwise later change what was
noticed in the past, too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.reporting.weekly_notice import NoticeKind, WeeklyNotice, WeeklyNotices
from monitor.statistics.weekly_looks import RATE, Look, WeeklyLooks
from monitor.store import (
    NOTE,
    Database,
    machine_descriptions,
    machine_events,
    machine_history,
    machine_runs,
    numbered_by,
)
from monitor.workflow.health.weeks import Week
from monitor.workflow.history.runs import only_runs, possible_campaigns
from monitor.workflow.history.series import steady_runs

#: A change of the whole vector names so many parameters at most, those that moved most for their scatter first.
NAMED = 3


@dataclass(frozen=True, eq=False)
class _MachineWeeks:
    """The weeks of a machine that have runs: ``weeks`` (n,) Mondays as ordinals, ``values`` (n, p) their means.

    ``anew`` (n,): something was done to the machine before this week's runs.
    """

    machine: str
    parameters: tuple[str, ...]
    units: Mapping[str, str]
    weeks: npt.NDArray[np.int64]
    values: Array
    anew: npt.NDArray[np.bool_]


def weekly_notices(db: Database, last: Week | None = None) -> WeeklyNotices:
    """Go through all weeks of all machines up to ``last`` (by default the last with a run) and say what was noticed.

    Each machine by the model that its numbers come from and the method of its last run, the steady runs of campaigns
    that one machine can have made. Recorded events that may have changed a machine let it begin anew.
    """
    fleet = [
        machine
        for description in machine_descriptions(db)
        if (machine := _machine_weeks(db, description.machine, last)) is not None
    ]
    return _looked(fleet)


def _machine_weeks(db: Database, name: str, last: Week | None) -> _MachineWeeks | None:
    """The weeks of a machine; None where it has no value."""
    # Weeks are compared with weeks: what all of them have in common is in no difference.
    history = machine_history(db, name, followed_by=numbered_by(db, name), has_parts=False)
    recorded = machine_runs(db, name)
    campaigns, _ = possible_campaigns(recorded, ())
    history = only_runs(
        history,
        [
            run
            for run in recorded
            if run.campaign in campaigns and (last is None or run.local_start < last.ends)
        ],
    )
    if not len(history.run):
        return None
    history = history.part(history.measured_by == history.measured_by[-1])
    history = history.part(steady_runs(history))
    if not len(history.run) or not history.parameters:
        return None
    # The week of a run by the shop's clock, as its Monday.
    days = [at.date() for at in history.started_at]
    mondays = np.array([day.toordinal() - day.weekday() for day in days], dtype=np.int64)
    moments = [event.at.timestamp() for event in machine_events(db, name) if event.kind != NOTE]
    era = np.searchsorted(np.sort(moments), history.seconds, side="right")
    # Of a week that an event divides the runs after it count.
    weeks, week_of = np.unique(mondays, return_inverse=True)
    latest = np.zeros(len(weeks), dtype=np.int64)
    np.maximum.at(latest, week_of, era)
    counts = era == latest[week_of]
    present = np.isfinite(history.values) & counts[:, np.newaxis]
    sums, runs = (
        np.zeros((len(weeks), len(history.parameters))),
        np.zeros((len(weeks), len(history.parameters))),
    )
    np.add.at(sums, week_of, np.where(present, history.values, 0.0))
    np.add.at(runs, week_of, present)
    with np.errstate(invalid="ignore"):
        means = sums / np.where(runs > 0.0, runs, np.nan)
    return _MachineWeeks(
        name,
        history.parameters,
        dict(zip(history.parameters, history.units, strict=True)),
        weeks,
        means,
        np.diff(latest, prepend=latest[:1]) > 0,
    )


def _looked(fleet: Sequence[_MachineWeeks]) -> WeeklyNotices:
    names = sorted({name for machine in fleet for name in machine.parameters})
    column = {name: j for j, name in enumerate(names)}
    columns = [np.array([column[name] for name in machine.parameters], dtype=np.int64) for machine in fleet]
    has = np.zeros((len(fleet), len(names)), dtype=np.bool_)
    for row, of_machine in enumerate(columns):
        has[row, of_machine] = True
    looks = WeeklyLooks(has)
    every = np.unique(np.concatenate([np.empty(0, dtype=np.int64), *(machine.weeks for machine in fleet)]))
    notices: list[WeeklyNotice] = []
    series = 0
    for week in every.tolist():
        values, anew = np.full(has.shape, np.nan), np.zeros(len(fleet), dtype=np.bool_)
        places = [int(np.searchsorted(machine.weeks, week)) for machine in fleet]
        for row, (machine, index) in enumerate(zip(fleet, places, strict=True)):
            if index < len(machine.weeks) and machine.weeks[index] == week:
                values[row, columns[row]] = machine.values[index]
                anew[row] = machine.anew[index]
        looks.restart(anew)
        look = looks.look(values)
        series = look.series
        notices += _notices(fleet, names, places, look)
    return WeeklyNotices(
        false_discovery_rate=RATE,
        weeks=len(every),
        machines=len(fleet),
        series=series,
        expected_false=looks.spent,
        notices=tuple(notices),
    )


def _notices(
    fleet: Sequence[_MachineWeeks], names: Sequence[str], places: Sequence[int], look: Look
) -> list[WeeklyNotice]:
    notices = []
    for row in np.flatnonzero(look.parameters.any(axis=1) | look.vectors).tolist():
        machine, last = fleet[row], places[row]
        for j in np.flatnonzero(look.parameters[row]).tolist():
            name = names[j]
            before, since = _sides(machine, (name,), last, int(look.since[row, j]))
            values = machine.values[:, machine.parameters.index(name)]
            notices.append(
                WeeklyNotice(
                    machine.machine, _week(machine, last), NoticeKind.PARAMETER, (name,),
                    _week(machine, int(before[-1])), _week(machine, int(since[0])),
                    float(values[since].mean() - values[before].mean()), machine.units[name],
                )
            )  # fmt: skip
        if look.vectors[row]:
            before, since = _sides(machine, machine.parameters, last, int(look.vector_since[row]))
            moved = machine.values[since].mean(axis=0) - machine.values[before].mean(axis=0)
            with np.errstate(divide="ignore", invalid="ignore"):
                scores = np.nan_to_num(np.abs(moved) / machine.values[before].std(axis=0))
            most = tuple(machine.parameters[k] for k in np.argsort(-scores, kind="stable")[:NAMED])
            notices.append(
                WeeklyNotice(
                    machine.machine, _week(machine, last), NoticeKind.VECTOR, most,
                    _week(machine, int(before[-1])), _week(machine, int(since[0])),
                )
            )  # fmt: skip
    return notices


def _sides(
    machine: _MachineWeeks, parameters: Sequence[str], last: int, since: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """The weeks (indices) before and since a change; the latter are ``since`` and end at ``last``."""
    began = int(np.flatnonzero(machine.anew[: last + 1])[-1]) if machine.anew[: last + 1].any() else 0
    columns = [machine.parameters.index(name) for name in parameters]
    measured = np.flatnonzero(np.isfinite(machine.values[: last + 1, columns]).all(axis=1))
    measured = measured[measured >= began]
    after = min(max(since, 1), len(measured) - 1)
    return measured[:-after], measured[-after:]


def _week(machine: _MachineWeeks, index: int) -> str:
    return Week(date.fromordinal(int(machine.weeks[index]))).name
