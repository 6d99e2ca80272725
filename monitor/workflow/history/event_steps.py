"""Steps of the parameters at recorded events: what an event changed, in size, as trend and report say it.

The search for changes splits the history at an event and looks within the pieces, so that a step at the event itself is
never found again. Here it is stated: the mean of the piece after the event less that of the piece before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.lacks import Undecided
from monitor.statistics.days.before_after import BeforeAfter, OtherDays, before_after
from monitor.statistics.days.rival_scatter import Allowance
from monitor.store import NOTE, MachineEvent
from monitor.workflow.history.calendar import days_since_1970
from monitor.workflow.history.past import ParameterPast
from monitor.workflow.history.series import Series

#: Probability of any stated step at an event where there is none, over all parameters and events of a machine. Larger
#: than that of the search: when to look is known beforehand, and an event that was recorded may well have changed
#: something.
EVENT_FALSE_ALARM = 0.05
#: Correlations of days that their likelihood leaves open: the level of a step of one of many parameters is low; with
#: 0.5 machines of four parameters whose days correlate by 0.6 have one in 12 % instead of 5 %.
REFUTED = 2.0
#: Days of a side that say little of how days differ: what they show of one parameter is named, not called.
FEW = 2
#: A side may hold many campaigns: how they differ is in the scatter of its days.
ALLOWANCE = Allowance(refuted=REFUTED, campaigns=0.0)


@dataclass(frozen=True)
class EventStep:
    """A parameter that stepped at an event: ``size`` with its standard uncertainty ``u``, in its display unit.

    ``at`` is the time of the event (days since 1970). ``by_days`` says whether ``u`` and ``p_value`` are by the
    scatter of the means of days; otherwise by that of the runs, which knows nothing of how days differ: then the step
    is not ``decided``, for one day a side may differ as much where nothing happened. Nor is it where independent days
    do not explain it and days that follow each other, or that scatter more on one side (``rival_scatter``), do; nor
    where one or two days of a side say too little of how days differ for a step among many parameters (``few_days``).
    """

    parameter: str
    unit: str
    event: MachineEvent
    at: float
    size: float
    u: float
    p_value: float
    by_days: bool
    decided: bool = True
    few_days: bool = False

    @property
    def undecided(self) -> Undecided | None:
        """Why it may be no step; None where it is decided."""
        if self.decided:
            return None
        if self.few_days:
            return Undecided.FEW_DAYS
        return Undecided.DAYS_MAY_DO if self.by_days else Undecided.ONE_DAY_EACH


@dataclass(frozen=True)
class _Compared:
    """Both sides of an event compared by the means of their days (None: too few), by their runs, and the p-value of
    days that follow each other or scatter differently on both sides; ``days``: of the side with fewer."""

    step: EventStep
    by_runs: tuple[float, float] | None
    rivals: float
    days: int


def event_steps(
    past: Mapping[str, ParameterPast], events: Sequence[MachineEvent], false_alarm: float = EVENT_FALSE_ALARM
) -> tuple[EventStep, ...]:
    """The steps at events that may have changed the machine, of all parameters, in the order of time.

    By the scatter of the days: those whose p-value lies below ``false_alarm`` over the number of comparisons
    (Bonferroni), so that ``false_alarm`` is the probability of any where there is none. Both sides of an event and all
    other pieces of the history say how days differ. What days that follow each other, or a side of wider scatter,
    explain is named as not decided (Bonferroni, too). Where no piece has two days nothing says so: what is large by the
    scatter of the runs is then named as not decided (``by_days`` is false). Of events between the same two runs the
    last one stands for all.
    """
    moments = {days_since_1970(event.at): event for event in events if event.kind != NOTE}
    compared = [pair for parameter in past.values() for pair in _of_parameter(parameter, moments)]
    level = false_alarm / max(len(compared), 1)
    steps = (_stated(pair, level, false_alarm) for pair in compared)
    return tuple(sorted((step for step in steps if step is not None), key=lambda step: step.at))


def _stated(pair: _Compared, level: float, alone: float) -> EventStep | None:
    """The step as it may be stated, None where it may not: by days at ``level``; by runs where no days can.

    What one or two days of a side show at the level ``alone`` of a single parameter, and runs at ``level``, is named.
    """
    step = pair.step
    if step.by_days and step.p_value < level:
        return replace(step, decided=pair.rivals < level)
    if step.by_days:
        by_runs = 1.0 if pair.by_runs is None else pair.by_runs[1]
        is_named = pair.days <= FEW and step.p_value < alone and by_runs < level
        return replace(step, decided=False, few_days=True) if is_named else None
    if pair.by_runs is None or pair.by_runs[1] >= level:
        return None
    u, p_value = pair.by_runs
    return replace(step, u=u, p_value=p_value, by_days=False, decided=False)


def _of_parameter(past: ParameterPast, moments: Mapping[float, MachineEvent]) -> list[_Compared]:
    steady = past.series.steady
    ends = np.array([-np.inf, *sorted({*moments, *(change.at for change in past.search.changes)}), np.inf])
    # Which days scatter about which mean: the pieces between all ends.
    pieces = np.searchsorted(ends, steady.t, side="right")
    pairs: dict[int, _Compared] = {}
    for at, event in sorted(moments.items()):
        first = int(np.searchsorted(steady.t, at))
        # An end between the same two runs bounds nothing: only those with a run in between do.
        earlier = ends[np.searchsorted(steady.t, ends) < first].max(initial=-np.inf)
        later = ends[np.searchsorted(steady.t, ends) > first].min(initial=np.inf)
        before = steady.part((steady.t >= earlier) & (steady.t < at))
        after = steady.part((steady.t >= at) & (steady.t < later))
        others = (steady.t < earlier) | (steady.t >= later)
        days = _by_days(before, after, steady.part(others), pieces[others])
        runs = _student(before.values, after.values)
        if runs is None and days is None:
            continue
        size = days.difference if days is not None else _difference_of_days(before, after)
        u, p_value = (days.u, _p_value(size, days.u, days.dof)) if days is not None else runs or (np.nan, 1.0)
        step = EventStep(steady.name, steady.unit, event, at, size, u, p_value, days is not None)
        rivals = 1.0 if days is None else max(p_value, days.p_value_of_rivals())
        pairs[first] = _Compared(step, runs, rivals, min(before.day_count, after.day_count))
    return list(pairs.values())


def _p_value(size: float, u: float, dof: float) -> float:
    return float(2.0 * scipy.special.stdtr(dof, -abs(size) / u))


def _by_days(before: Series, after: Series, rest: Series, pieces: npt.NDArray[np.intp]) -> BeforeAfter | None:
    """The comparison by the scatter of the means of days, each with its number of runs; None where nothing says it."""
    if min(len(before.values), len(after.values)) == 0:
        return None
    others = OtherDays(rest.values, rest.days, pieces, pieces)
    try:
        result = before_after(before.values, after.values, before.days, after.days, others, ALLOWANCE)
    except DataError:
        return None
    return result if result.decided else None


def _student(first: Array, second: Array) -> tuple[float, float] | None:
    """Standard uncertainty of the difference of the means of two groups of runs and its p-value, with the scatter
    common to them; None without one."""
    freedom = len(first) + len(second) - 2
    if min(len(first), len(second)) < 1 or freedom < 1:
        return None
    squares = sum(float(np.sum((group - group.mean()) ** 2)) for group in (first, second))
    u = float(np.sqrt(squares / freedom * (1.0 / len(first) + 1.0 / len(second))))
    return None if u <= 0.0 else (u, _p_value(float(second.mean() - first.mean()), u, freedom))


def _difference_of_days(before: Series, after: Series) -> float:
    """Mean of the means of the days after less that before; 0 where a side has none."""
    if min(len(before.values), len(after.values)) == 0:
        return 0.0
    first, second = (
        np.bincount(index, side.values) / np.bincount(index)
        for side in (before, after)
        for index in [np.unique(side.days, return_inverse=True)[1]]
    )
    return float(second.mean() - first.mean())
