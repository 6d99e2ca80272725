"""The past of a machine: of every parameter its series, when it changed, and its drift since then.

Trend page and health report read this one record; the same runs and events give the same past. The fleet table, which
never reads the runs of a machine, computes its drift from sums in the database; what differs by definition is in
docs/statistics.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from monitor.statistics import Change
from monitor.store import NOTE, MachineEvent, MachineHistory
from monitor.workflow.history.calendar import days_since_1970
from monitor.workflow.history.changes import ChangeSearch, search_changes
from monitor.workflow.history.drift import PieceDrift
from monitor.workflow.history.season import SlopeVerdict
from monitor.workflow.history.series import Series, parameter_series


@dataclass(frozen=True, eq=False)
class ParameterPast:
    """One parameter: its ``series`` of all runs that have it, ``mask`` (n,) of those among the runs of the machine.

    ``search`` has its changes, ``drift`` the steady runs since the last of them, or since the last event. A drift of
    these that the search found too has the slope, u and p-value of the line that is stated: one slope has one of each.
    """

    series: Series
    mask: npt.NDArray[np.bool_]
    search: ChangeSearch
    drift: PieceDrift

    def is_of_latest_day(self, change: Change) -> bool:
        """Whether a change is a step after which there is one day alone."""
        return change.kind == "step" and self.series.steady.days_since(change.at) == 1

    def is_maybe_season(self, change: Change) -> bool:
        """Whether a drift of the present piece that the search found may be a season."""
        return change.at >= self.drift.begins and self.drift.verdict is SlopeVerdict.DRIFT_OR_SEASON


def splitting_events(events: Sequence[MachineEvent]) -> list[float]:
    """Times (days since 1970) of the events that may have changed the machine; a note changes nothing."""
    return [days_since_1970(event.at) for event in events if event.kind != NOTE]


def machine_past(history: MachineHistory, events: Sequence[float]) -> dict[str, ParameterPast]:
    """The past of every parameter that a run has; ``events`` split it (days since 1970)."""
    every = parameter_series(history)
    searches = search_changes([series.steady for series, _ in every.values()], events)
    past = {}
    for name, (series, mask) in every.items():
        drift = _drift(series.steady, searches[name], events)
        past[name] = ParameterPast(series, mask, _as_stated(searches[name], drift), drift)
    return past


def _drift(steady: Series, search: ChangeSearch, events: Sequence[float]) -> PieceDrift:
    """The present piece of history: since the last event or change."""
    event = max((at for at in events if at <= steady.t[-1]), default=-np.inf)
    return PieceDrift(steady, max((event, *(change.at for change in search.changes))), event)


def _as_stated(search: ChangeSearch, drift: PieceDrift) -> ChangeSearch:
    """The search with the stated line of the present piece in place of the slope that it found there.

    Its own u takes days as independent, so that it is too small where they resemble each other.
    """
    line = drift.stated
    if line is None:
        return search
    drifts = tuple(
        replace(change, size=line.slope, u=line.u_slope, p_value=line.p_value)
        if change.kind == "trend" and change.at >= drift.begins
        else change
        for change in search.drifts
    )
    return replace(search, drifts=drifts)
