"""Steps of the parameters at recorded events: what an event changed, in size, as trend and report say it.

The search for changes splits the history at an event and looks within the pieces, so that a step at the event itself is
never found again. Here it is stated: the mean of the piece after the event less that of the piece before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from monitor.records import Array
from monitor.statistics.following_days import following_days
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


@dataclass(frozen=True)
class EventStep:
    """A parameter that stepped at an event: ``size`` with its standard uncertainty ``u``, in its display unit.

    ``at`` is the time of the event (days since 1970). ``by_days`` says whether ``u`` and ``p_value`` are by the
    scatter of the means of days; otherwise by that of the runs, which knows nothing of how days differ: then the step
    is not ``decided``, for one day a side may differ as much where nothing happened. Nor is it where independent days
    do not explain it and days that follow each other (``following_days``) do.
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


@dataclass(frozen=True)
class _Compared:
    """Both sides of an event compared by the means of their days (None: too few), by their runs, and the p-value of
    days that follow each other."""

    step: EventStep
    by_runs: tuple[float, float] | None
    following: float


def event_steps(
    past: Mapping[str, ParameterPast], events: Sequence[MachineEvent], false_alarm: float = EVENT_FALSE_ALARM
) -> tuple[EventStep, ...]:
    """The steps at events that may have changed the machine, of all parameters, in the order of time.

    By the scatter of the days: those whose p-value lies below ``false_alarm`` over the number of comparisons
    (Bonferroni), so that ``false_alarm`` is the probability of any where there is none. Both sides of an event and all
    other pieces of the history say how days differ. What days that follow each other explain is named as not decided
    (Bonferroni, too). Where no piece has two days nothing says so: what is large by the
    scatter of the runs is then named as not decided (``by_days`` is false). Of events between the same two runs the
    last one stands for all.
    """
    moments = {days_since_1970(event.at): event for event in events if event.kind != NOTE}
    compared = [pair for parameter in past.values() for pair in _of_parameter(parameter, moments)]
    level = false_alarm / max(len(compared), 1)
    steps = (_stated(pair, level) for pair in compared)
    return tuple(sorted((step for step in steps if step is not None), key=lambda step: step.at))


def _stated(pair: _Compared, level: float) -> EventStep | None:
    """The step as it may be stated, None where it may not: by days at ``level``; by runs where no days can."""
    step = pair.step
    if step.by_days:
        return replace(step, decided=pair.following < level) if step.p_value < level else None
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
        means = _means(before), _means(after)
        others = (steady.t < earlier) | (steady.t >= later)
        rest = [_means(steady.part(others & (pieces == piece))) for piece in np.unique(pieces[others])]
        days, runs = _student(*means, rest), _student(before.values, after.values)
        if runs is None and days is None:
            continue
        size = float(means[1].mean() - means[0].mean()) if min(map(len, means)) else 0.0
        u, p_value = days or runs or (np.nan, 1.0)
        pairs[first] = _Compared(
            EventStep(steady.name, steady.unit, event, at, size, u, p_value, days is not None), runs,
            max(p_value, _following(size, [*means, *rest])),
        )  # fmt: skip
    return list(pairs.values())


def _student(first: Array, second: Array, rest: Sequence[Array] = ()) -> tuple[float, float] | None:
    """Standard uncertainty of the difference of two means and its p-value, with the scatter common to them and to the
    groups of the ``rest`` about their means; None without one."""
    groups = [first, second, *rest]
    freedom = sum(len(group) - 1 for group in groups)
    if min(len(first), len(second)) < 1 or freedom < 1:
        return None
    squares = sum(float(np.sum((group - group.mean()) ** 2)) for group in groups)
    u = float(np.sqrt(squares / freedom * (1.0 / len(first) + 1.0 / len(second))))
    if u <= 0.0:
        return None
    return u, float(2.0 * scipy.special.stdtr(freedom, -abs(second.mean() - first.mean()) / u))


def _following(size: float, groups: Sequence[Array]) -> float:
    """The p-value of a difference of the first two groups of days if every day resembles the one before it."""
    stretch = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
    if min(len(groups[0]), len(groups[1])) < 1:
        return 1.0
    result = following_days(np.concatenate(groups), stretch, stretch, (0, 1), refuted=REFUTED)
    if result is None or result.u <= 0.0:
        return 1.0
    return float(2.0 * scipy.special.stdtr(result.dof, -abs(size) / result.u))


def _means(series: Series) -> Array:
    """Means of the days of a part of the history; none of an empty one."""
    if not len(series.days):
        return np.empty(0)
    _, index = np.unique(series.days, return_inverse=True)
    return np.asarray(np.bincount(index, series.values) / np.bincount(index))
