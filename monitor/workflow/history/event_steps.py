"""Steps of the parameters at recorded events: what an event changed, in size, as trend and report say it.

The search for changes splits the history at an event and looks within the pieces, so that a step at the event itself is
never found again. Here it is stated: the mean of the piece after the event less that of the piece before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from monitor.records import Array
from monitor.store import NOTE, MachineEvent
from monitor.workflow.history.calendar import days_since_1970
from monitor.workflow.history.past import ParameterPast
from monitor.workflow.history.series import Series

#: Probability of any stated step at an event where there is none, over all parameters and events of a machine. Larger
#: than that of the search: when to look is known beforehand, and an event that was recorded may well have changed
#: something.
EVENT_FALSE_ALARM = 0.05


@dataclass(frozen=True)
class EventStep:
    """A parameter that stepped at an event: ``size`` with its standard uncertainty ``u``, in its display unit.

    ``at`` is the time of the event (days since 1970). ``by_days`` says whether the scatter is that of the days on both
    sides; of a single day on a side it is that of the runs, which knows nothing of how days differ.
    """

    parameter: str
    unit: str
    event: MachineEvent
    at: float
    size: float
    u: float
    p_value: float
    by_days: bool


def event_steps(
    past: Mapping[str, ParameterPast], events: Sequence[MachineEvent], false_alarm: float = EVENT_FALSE_ALARM
) -> tuple[EventStep, ...]:
    """The steps at events that may have changed the machine, of all parameters, in the order of time.

    Those whose p-value lies below ``false_alarm`` over the number of comparisons (Bonferroni), so that
    ``false_alarm`` is the probability of any where there is none. Of events between the same two runs the last one
    stands for all.
    """
    moments = {days_since_1970(event.at): event for event in events if event.kind != NOTE}
    compared = [step for parameter in past.values() for step in _of_parameter(parameter, moments)]
    level = false_alarm / max(len(compared), 1)
    return tuple(sorted((step for step in compared if step.p_value < level), key=lambda step: step.at))


def _of_parameter(past: ParameterPast, moments: Mapping[float, MachineEvent]) -> list[EventStep]:
    steady = past.series.steady
    ends = np.array([-np.inf, *sorted({*moments, *(change.at for change in past.search.changes)}), np.inf])
    steps: dict[int, EventStep] = {}
    for at, event in sorted(moments.items()):
        first = int(np.searchsorted(steady.t, at))
        # An end between the same two runs bounds nothing: only those with a run in between do.
        earlier = ends[np.searchsorted(steady.t, ends) < first].max(initial=-np.inf)
        later = ends[np.searchsorted(steady.t, ends) > first].min(initial=np.inf)
        before = steady.part((steady.t >= earlier) & (steady.t < at))
        after = steady.part((steady.t >= at) & (steady.t < later))
        step = _compared(before, after)
        if step is not None:
            steps[first] = EventStep(steady.name, steady.unit, event, at, *step)
    return list(steps.values())


def _compared(before: Series, after: Series) -> tuple[float, float, float, bool] | None:
    """Size, u, p-value and whether days were compared; None where the scatter is not known.

    Student's two samples with a common scatter: of the means of the days, which a day component makes scatter more than
    their runs. With one day on either side only the runs are left.
    """
    by_days = before.day_count >= 1 and after.day_count >= 1 and before.day_count + after.day_count >= 3
    first, second = (_means(series) if by_days else series.values for series in (before, after))
    freedom = len(first) + len(second) - 2
    if min(len(first), len(second)) < 1 or freedom < 1:
        return None
    squares = float(np.sum((first - first.mean()) ** 2) + np.sum((second - second.mean()) ** 2))
    u = float(np.sqrt(squares / freedom * (1.0 / len(first) + 1.0 / len(second))))
    if u <= 0.0:
        return None
    size = float(second.mean() - first.mean())
    # Loaded here: pages without an event do not wait for it.
    from scipy.special import stdtr

    return size, u, float(2.0 * stdtr(freedom, -abs(size) / u)), by_days


def _means(series: Series) -> Array:
    _, index = np.unique(series.days, return_inverse=True)
    return np.asarray(np.bincount(index, series.values) / np.bincount(index))
