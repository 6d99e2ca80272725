"""Steps of the parameters at recorded events: what an event changed, in size, as trend and report say it.

The search for changes splits the history at an event and looks within the pieces, so that a step at the event itself is
never found again. Here it is stated: the mean of the piece after the event less that of the piece before, or, where
enough campaigns say what the machine does between events, the step between the lines of its drift.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.lacks import Undecided
from monitor.statistics.days.before_after import BeforeAfter, OtherDays, before_after
from monitor.statistics.days.beside_drift import BesideDrift, Verdict, beside_drift
from monitor.statistics.days.rival_scatter import Allowance
from monitor.statistics.days.stepped_line import Campaigns, campaigns_of
from monitor.statistics.groups import most_common
from monitor.store import NOTE, MachineEvent
from monitor.workflow.history.calendar import days_since_1970
from monitor.workflow.history.other_instruments import calibrations_may_do
from monitor.workflow.history.past import ParameterPast
from monitor.workflow.history.series import Series

if TYPE_CHECKING:
    from monitor.reporting.health.news import SteppedAtEvent

#: Probability of any stated step at an event where there is none, over all parameters and events of a machine. Larger
#: than that of the search: when to look is known beforehand, and an event that was recorded may well have changed
#: something.
EVENT_FALSE_ALARM = 0.05
#: Correlations of days that their likelihood leaves open: the level of a step of one of many parameters is low; with
#: 0.5 machines of four parameters whose days correlate by 0.6 have one in 12 % instead of 5 %.
REFUTED = 2.0
#: Days of a side that say little of how days differ: what they show of one parameter is named, not called.
FEW = 2
#: A drift is stated over so many days.
DAYS_OF_DRIFT = 30.0
#: Why a step that a verdict leaves open is not decided.
_UNDECIDED = {Verdict.DAYS: Undecided.DAYS_MAY_DO, Verdict.DRIFT: Undecided.DRIFT_MAY_DO}
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
    Where other instruments measured on each side it is not, if their calibrations may be all of it; where some measured
    on both, these are compared. Where campaigns say what the machine does between events, ``size`` is beyond its drift
    (``beside_drift``), which is ``drift`` in 30 days where one is seen.
    """

    parameter: str
    unit: str
    event: MachineEvent
    at: float
    size: float
    u: float
    p_value: float
    by_days: bool
    undecided: Undecided | None = None
    drift: float | None = None

    @property
    def decided(self) -> bool:
        """Whether it is a step."""
        return self.undecided is None

    @property
    def in_words(self) -> SteppedAtEvent:
        """The sentence of report and workbook: the size, and why that may be no step."""
        # Loaded here: most machines have no step at an event, and the report has two dozen kinds of sentences.
        from monitor.reporting.health.news import SteppedAtEvent

        return SteppedAtEvent(
            self.parameter, self.event.description, self.size, self.u, self.unit, self.undecided, self.drift
        )


@dataclass(frozen=True)
class _Compared:
    """Both sides of an event compared by their days and campaigns, and by their runs (None: too few); ``days``: of the
    side with fewer; ``by_others``: other instruments measured on each side, and may be all of it."""

    step: EventStep
    by_runs: tuple[float, float] | None
    judged: BesideDrift
    days: int
    by_others: bool = False


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
    """The step as it may be stated, None where it may not: by days and campaigns at ``level``; by runs where these
    cannot.

    What one or two days of a side show at the level ``alone`` of a single parameter, and runs at ``level``, is named.
    """
    step, verdict = pair.step, pair.judged.verdict(level)
    days = pair.judged.days
    if verdict is Verdict.DRIFT and days is not None:
        step = replace(step, size=days.difference, u=days.u, p_value=days.p_value())
    if pair.by_others and (verdict is Verdict.STEPPED or verdict in _UNDECIDED):
        return replace(step, undecided=Undecided.INSTRUMENTS_MAY_DO)
    if verdict in _UNDECIDED:
        return replace(step, undecided=_UNDECIDED[verdict])
    if verdict is Verdict.STEPPED:
        return step
    if pair.by_runs is None or pair.by_runs[1] >= level or pair.judged.line is not None:
        return None
    if verdict is Verdict.NOT_SEEN:
        is_named = pair.days <= FEW and step.p_value < alone
        return replace(step, undecided=Undecided.FEW_DAYS) if is_named else None
    u, p_value = pair.by_runs
    return replace(step, u=u, p_value=p_value, by_days=False, undecided=Undecided.ONE_DAY_EACH)


def _of_parameter(past: ParameterPast, moments: Mapping[float, MachineEvent]) -> list[_Compared]:
    steady = past.series.steady.sure
    ends = np.array([-np.inf, *sorted({*moments, *(change.at for change in past.search.changes)}), np.inf])
    # Which days scatter about which mean: the pieces between all ends.
    pieces = np.searchsorted(ends, steady.t, side="right")
    campaigns = _campaigns(steady, pieces, moments)
    pairs: dict[int, _Compared] = {}
    for at, event in sorted(moments.items()):
        first = int(np.searchsorted(steady.t, at))
        # An end between the same two runs bounds nothing: only those with a run in between do.
        earlier = ends[np.searchsorted(steady.t, ends) < first].max(initial=-np.inf)
        later = ends[np.searchsorted(steady.t, ends) > first].min(initial=np.inf)
        before = steady.part((steady.t >= earlier) & (steady.t < at))
        after = steady.part((steady.t >= at) & (steady.t < later))
        others = (steady.t < earlier) | (steady.t >= later)
        both = most_common([before.measured, after.measured])
        if both is not None:
            before, after = (side.part(side.measured == both) for side in (before, after))
            others &= steady.measured == both
        days = _by_days(before, after, steady.part(others), pieces[others])
        runs = _student(before.values, after.values)
        judged = _beside_drift(days, campaigns, int(pieces[first - 1]) if first else None)
        if runs is None and days is None and judged.line is None:
            continue
        numbers = _step(judged, runs, _difference_of_days(before, after))
        line = judged.line
        drift = line.rate * DAYS_OF_DRIFT if line is not None and line.drifts else None
        step = EventStep(steady.name, steady.unit, event, at, *numbers, drift=drift)
        by_others = both is None and judged.line is None and _may_be_calibrations(step, before, after)
        pairs[first] = _Compared(step, runs, judged, min(before.day_count, after.day_count), by_others)
    return list(pairs.values())


def _may_be_calibrations(step: EventStep, before: Series, after: Series) -> bool:
    if min(len(before.values), len(after.values)) == 0:
        return False
    return calibrations_may_do(step.size, step.u, after.common_of_mean - before.common_of_mean)


def _campaigns(steady: Series, pieces: npt.NDArray[np.intp], moments: Collection[float]) -> Campaigns | None:
    """The campaigns between events at ``moments`` and changes; None where nobody says them."""
    if steady.campaign is None:
        return None
    eras = np.searchsorted(np.sort(list(moments)), steady.t, side="right")
    return campaigns_of(steady.values, steady.days, steady.t, pieces, steady.campaign, eras, steady.measured)


def _beside_drift(days: BeforeAfter | None, campaigns: Campaigns | None, before: int | None) -> BesideDrift:
    """The piece ``before`` an event and what follows, judged by days and campaigns; None: an event before all runs."""
    if campaigns is None or before is None:
        return BesideDrift(days, None, 0.0, 0.0, 0)
    last = int(np.flatnonzero(campaigns.piece <= before)[-1])
    if last + 1 == len(campaigns.mean):
        return BesideDrift(days, None, 0.0, 0.0, 0)
    return beside_drift(days, campaigns, last, last + 1, levels=True)


def _step(
    judged: BesideDrift, runs: tuple[float, float] | None, difference: float
) -> tuple[float, float, float, bool]:
    """Size, u, p-value of a step, and whether they are by days: by campaigns, by days, by runs."""
    if judged.line is not None:
        return judged.line.step, judged.line.u, judged.line.p_value(), True
    if judged.days is not None:
        return judged.days.difference, judged.days.u, judged.days.p_value(), True
    return difference, *(runs or (np.nan, 1.0)), False


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
