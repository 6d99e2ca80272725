"""Control charts of a machine's parameters against a reference period: which alarm can be believed.

Points are the runs, or the means of the days where there are enough of them: runs of one day resemble each other,
and a chart that takes them for independent raises false alarms. A recorded event begins the charts anew, as it splits
the history: the step that it explains is stated at the event, and no alarm. Of several instruments, each off by its own
amount, the charts are of one alone, that which measured last of those with points enough. Part of `monitor trend`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import timedelta

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.lacks import Cause, Lack, Part, refused
from monitor.statistics import (
    correlated_reference,
    cusum_chart,
    ewma_chart,
    individuals_chart,
    mewma_chart,
    t_squared_chart,
)
from monitor.store import MachineHistory
from monitor.workflow.history.calendar import SECONDS_PER_DAY, date
from monitor.workflow.history.changes import DAYS_FOR_MEANS
from monitor.workflow.history.series import day_numbers, steady_runs
from monitor.workflow.history.what_measured import what_measured
from monitor.workflow.trend.charts_answer import (
    CusumState,
    EwmaState,
    ParameterCharts,
    ReferencePeriod,
    ShewhartState,
    VectorCharts,
    VectorState,
)

#: Average number of points to a false alarm of each chart: that of the three-sigma chart, rounded.
RUN_LENGTH = 370.0
#: The same of MEWMA, whose limit is simulated with so many trials.
VECTOR_RUN_LENGTH, VECTOR_TRIALS = 200.0, 1000
#: Weight of the latest point in EWMA (Lucas and Saccucci, Technometrics 32 (1990) 1).
EWMA_WEIGHT = 0.2
#: Without a named reference period: the first points since the last event, a third of all, at least 8 and at most 30.
SHARE, FEWEST, MOST = 3, 8, 30
#: Another calibration shows in a chart from this part of the scatter of its points on: two are apart by 1.4 of it.
SHOWS = 0.25
#: Median of what two values of a normal distribution of standard deviation 1 differ by.
MEDIAN_APART = 0.954
#: A parameter takes part in the charts of the vector where it has more than this share of the points.
COMPLETE = 0.9


@dataclass(frozen=True)
class Points:
    """What the charts are of: ``values`` (m, p) NaN where a parameter has none, ``t`` (m,) days since 1970."""

    values: Array
    t: Array
    kind: str
    offset: timedelta


def are_days(history: MachineHistory) -> bool:
    """Whether there are enough days for their means to be the points."""
    return len(np.unique(day_numbers(history)[steady_runs(history)])) >= DAYS_FOR_MEANS


def points_of(history: MachineHistory, offset: timedelta, *, by_days: bool) -> Points:
    """Points of the charts: day means or runs; runs of a warming machine left out."""
    t = history.seconds / SECONDS_PER_DAY
    steady = steady_runs(history)
    labels, values = day_numbers(history)[steady], history.values[steady]
    if not by_days:
        return Points(values, t[steady], "runs", offset)
    distinct, first, index = np.unique(labels, return_index=True, return_inverse=True)
    finite = np.isfinite(values)
    sums, counts = np.zeros((len(distinct), values.shape[1])), np.zeros((len(distinct), values.shape[1]))
    np.add.at(sums, index, np.where(finite, values, 0.0))
    np.add.at(counts, index, finite)
    means = sums / np.where(counts > 0, counts, np.nan)
    order = np.argsort(first, kind="stable")
    moments = np.bincount(index, t[steady]) / np.bincount(index)
    return Points(means[order], moments[order], "days", offset)


def since_last_event(history: MachineHistory, events: Sequence[float]) -> MachineHistory:
    """The runs since the last of ``events`` (days since 1970) behind which there is a steady run."""
    t = history.seconds / SECONDS_PER_DAY
    last = t[steady_runs(history)].max()
    return history.part(t >= max((at for at in events if at <= last), default=-np.inf))


def by_one_instrument(history: MachineHistory, *, by_days: bool) -> tuple[MachineHistory, str | None]:
    """The runs by the instruments, with their certificates, that measured last of those with more points than the
    shortest reference period; whatever the certificates where each has too few, and of the last ones where all have.
    With what they are called, None where all are by one."""
    steady = steady_runs(history)
    labels = day_numbers(history) if by_days else np.arange(len(history.run))
    scatter = _scatter(points_of(history, timedelta(0), by_days=by_days).values)
    for certified in (_that_show(history, scatter), {}):
        calibrations = replace(history.calibrations, certificates=certified)
        names, by = what_measured(replace(history, calibrations=calibrations))
        if len(names) == 1:
            return history, None
        groups = range(len(names))
        enough = [group for group in groups if len(np.unique(labels[steady & (by == group)])) > FEWEST]
        if enough:
            break
    charted = by[np.isin(by, enough)][-1] if enough else by[-1]
    return history.part(by == charted), names[charted]


def _that_show(history: MachineHistory, scatter: Array) -> dict[str, dict[str, str]]:
    """The certificates of each campaign, without those of instruments of which no parameter has so much of its
    ``scatter`` (p,) that another calibration shows in a chart; where nothing is stored of that, it may show."""
    hidden: dict[str, bool] = {}
    for quantity, part in history.common_parts.items():
        is_hidden = not bool((np.abs(part) > SHOWS * scatter).any())
        hidden[quantity.of] = hidden.get(quantity.of, True) and is_hidden
    return {
        campaign: {of: certificate for of, certificate in certificates.items() if not hidden.get(of, False)}
        for campaign, certificates in history.calibrations.certificates.items()
    }


def _scatter(points: Array) -> Array:
    """How points (m, p) scatter, (p,), by what neighbours differ by: a step between two of them counts little."""
    columns = (column[np.isfinite(column)] for column in points.T)
    apart = (np.abs(np.diff(column)) for column in columns)
    return np.array([float(np.median(each)) / MEDIAN_APART if len(each) else 0.0 for each in apart])


def reference_points(points: Points, reference: tuple[float, float] | None) -> npt.NDArray[np.bool_]:
    """Mask (m,) of the reference period: the points between two times, or the first ones."""
    if reference is not None:
        return (points.t >= reference[0]) & (points.t < reference[1])
    count = int(np.clip(len(points.t) // SHARE, FEWEST, MOST))
    return np.asarray(np.arange(len(points.t)) < count)


class Charts:
    """All charts of a machine about one reference period: a named one (days since 1970), whatever happened and whoever
    measured, or the first points since the last of ``events`` by one instrument."""

    def __init__(
        self, history: MachineHistory, offset: timedelta, events: Sequence[float],
        reference: tuple[float, float] | None,
    ) -> None:  # fmt: skip
        charted = history if reference is not None else since_last_event(history, events)
        # By the whole history: of the few days since an event the runs resemble each other, too.
        by_days = are_days(history)
        self.is_since_event = len(charted.run) < len(history.run)
        self.instruments = None
        self.several = reference is not None and len(what_measured(charted)[0]) > 1
        if reference is None:
            charted, self.instruments = by_one_instrument(charted, by_days=by_days)
        self.points = points_of(charted, offset, by_days=by_days)
        self.inside = reference_points(self.points, reference)

    def period(self) -> ReferencePeriod:
        """The reference period in words and dates."""
        times = self.points.t[self.inside]
        first, last = (self._date(times[index]) if len(times) else None for index in (0, -1))
        return ReferencePeriod(
            self.points.kind, len(times), first, last, RUN_LENGTH, self.instruments, self.several or None
        )

    def of(self, column: int) -> ParameterCharts:
        """Shewhart, EWMA and CUSUM of one parameter: state, limits, and the alarms after the reference period."""
        finite = np.isfinite(self.points.values[:, column])
        before = self.points.values[finite & self.inside, column]
        after = finite & ~self.inside
        values, t = self.points.values[after, column], self.points.t[after]
        if not len(before):
            return ParameterCharts(Lack(Part.CHART, Cause.NONE_IN_REFERENCE))
        try:
            reference = correlated_reference(before)
        except DataError as error:
            return ParameterCharts(refused(Part.CHART, error))
        if not len(values):
            return ParameterCharts(self._all_in_reference(len(before)))
        plain = individuals_chart(values, reference, arl=RUN_LENGTH)
        path = ewma_chart(values, reference, arl=RUN_LENGTH)
        sums = cusum_chart(values, reference, arl=RUN_LENGTH)
        return ParameterCharts(
            None,
            reference.centre,
            reference.sd,
            ShewhartState(*self._state(plain.alarms, t), float(plain.lower[-1]), float(plain.upper[-1])),
            EwmaState(
                *self._state(path.alarms, t), float(path.statistic[-1]), float(path.lower[-1]),
                float(path.upper[-1]), EWMA_WEIGHT,
            ),
            CusumState(
                *self._state(sums.alarms, t), float(sums.high[-1]), float(sums.low[-1]), sums.limit,
                None if sums.started is None else self._date(t[sums.started]),
            ),
        )  # fmt: skip

    def _all_in_reference(self, count: int) -> Lack:
        cause = Cause.ALL_SINCE_EVENT_IN_REFERENCE if self.is_since_event else Cause.ALL_IN_REFERENCE
        by = "" if self.instruments is None else f" by {self.instruments}"
        return Lack(Part.CHART, cause, count=count, name=f"{self.points.kind}{by}")

    def of_vector(self, names: tuple[str, ...], rng: np.random.Generator) -> VectorCharts:
        """T² and MEWMA of all parameters together; the shares say which of them raise the latest point."""
        finite = np.isfinite(self.points.values)
        columns = finite.mean(axis=0) > COMPLETE
        # What never varies in the reference period has no limits, and no part in the vector.
        before = np.where(finite & self.inside[:, np.newaxis], self.points.values, np.nan)
        columns &= np.nanmax(before, axis=0, initial=-np.inf) > np.nanmin(before, axis=0, initial=np.inf)
        rows = finite[:, columns].all(axis=1)
        used = tuple(name for name, takes_part in zip(names, columns, strict=True) if takes_part)
        values = self.points.values[:, columns]
        before, after = values[rows & self.inside], values[rows & ~self.inside]
        if len(after) == 0 or len(before) < len(used) + 2:
            lack = Lack(
                Part.VECTOR_CHART, Cause.FEW_POINTS, len(before), len(after), len(used), (len(used) + 2,),
                name=self.points.kind,
            )  # fmt: skip
            return VectorCharts(lack)
        t = self.points.t[rows & ~self.inside]
        try:
            single = t_squared_chart(after, before, arl=RUN_LENGTH, correlated=True)
            path = mewma_chart(
                after, before, rng=rng, arl=VECTOR_RUN_LENGTH, trials=VECTOR_TRIALS, correlated=True
            )
        except DataError as error:
            return VectorCharts(refused(Part.VECTOR_CHART, error))
        shares, path_shares = (
            dict(zip(used, map(float, chart.shares[-1]), strict=True)) for chart in (single, path)
        )
        return VectorCharts(
            None,
            used,
            VectorState(*self._state(single.alarms, t), float(single.statistic[-1]), single.limit, shares),
            VectorState(
                *self._state(path.alarms, t), float(path.statistic[-1]), path.limit, path_shares,
                average_run_length=VECTOR_RUN_LENGTH,
            ),
        )  # fmt: skip

    def _state(self, alarms: npt.NDArray[np.int64], t: Array) -> tuple[str, int, str | None, str | None]:
        """The fields of a ``ChartState``."""
        state = "alarm" if len(alarms) and int(alarms[-1]) == len(t) - 1 else "in control"
        first, last = (self._date(t[alarms[index]]) if len(alarms) else None for index in (0, -1))
        return state, len(alarms), first, last

    def _date(self, t: float) -> str | None:
        return date(float(t), self.points.offset)
