"""Two periods of a machine side by side: what each parameter and each condition was, and whether it differs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError, InputError
from monitor.statistics import control_false_discoveries
from monitor.statistics.days.before_after import BeforeAfter, OtherDays, before_after
from monitor.store import Database, MachineHistory, machine_history, numbered_by
from monitor.workflow.history.calendar import SECONDS_PER_DAY
from monitor.workflow.history.series import Series, parameter_series
from monitor.workflow.moments import at_machine, check_period

#: False discovery rate over the parameters of a comparison.
RATE = 0.05


@dataclass(frozen=True)
class Period:
    """A period: ``since`` belongs to it, ``until`` does not; without an offset from UTC by the clock of the shop.

    Raises InputError for one that is empty.
    """

    since: datetime
    until: datetime

    def __post_init__(self) -> None:
        check_period(self.since, self.until)

    def at_machine(self, db: Database, machine: str) -> Period:
        """Return the period with the offsets that the clock of the machine's shop had."""
        return Period(at_machine(db, machine, self.since), at_machine(db, machine, self.until))


@dataclass(frozen=True)
class PeriodsRequest:
    """The ``earlier`` and the ``later`` period of a machine, which do not overlap."""

    machine: str
    earlier: Period
    later: Period

    def __post_init__(self) -> None:
        ends = (self.earlier.until, self.later.since)
        # By different clocks they are compared once both have an offset.
        if (ends[0].tzinfo is None) == (ends[1].tzinfo is None) and ends[1] < ends[0]:
            raise InputError(
                "the periods overlap, or the later one comes first; end one before the other begins"
            )


@dataclass(frozen=True)
class ParameterOfPeriods:
    """A parameter in both periods, None where one has no run: means over the days, their difference (later less
    earlier) with its standard uncertainty by the scatter of the days and its coverage factor ``k`` for 95 %.

    ``q_value`` is the false discovery rate at which the parameter is among those that differ, over all parameters of
    the comparison (Benjamini and Hochberg); ``p_value`` is its own. ``differs`` is whether that rate is at most 5 %;
    None where the days do not say how days differ, or where days that are not independent may explain it by themselves.
    """

    unit: str
    earlier: float | None
    later: float | None
    difference: float | None
    u: float | None
    k: float | None
    p_value: float | None
    q_value: float | None
    differs: bool | None
    tolerance: float | None


@dataclass(frozen=True)
class ConditionOfPeriods:
    """Means of a recorded condition in both periods."""

    earlier: float | None
    later: float | None


@dataclass(frozen=True)
class PeriodsAnswer:
    """Both periods with their numbers of runs and days, and every parameter and condition."""

    machine: str
    earlier: Period
    later: Period
    runs: tuple[int, int]
    days: tuple[int, int]
    parameters: Mapping[str, ParameterOfPeriods]
    conditions: Mapping[str, ConditionOfPeriods]


def periods(db: Database, request: PeriodsRequest) -> PeriodsAnswer:
    """Compare two periods of a machine as events are compared: by the means of days. Nothing is stored.

    Runs that are marked as warming up take no part where enough others remain. Raises NotFoundError for a machine that
    is not there, DataError where a period has no run.
    """
    machine = request.machine
    request = PeriodsRequest(
        machine, request.earlier.at_machine(db, machine), request.later.at_machine(db, machine)
    )
    history = machine_history(db, request.machine, followed_by=numbered_by(db, request.machine))
    masks = [_within(history, period) for period in (request.earlier, request.later)]
    for mask, period in zip(masks, (request.earlier, request.later), strict=True):
        if not mask.any():
            raise DataError(
                f"machine {request.machine} has no identified run from {period.since:%Y-%m-%d} to "
                f"{period.until:%Y-%m-%d}"
            )
    days = [len({at.date() for at in history.part(mask).started_at}) for mask in masks]
    compared = {
        name: _compared(series, history.campaign[of], request, history.tolerances.get(name))
        for name, (series, of) in parameter_series(history).items()
    }
    return PeriodsAnswer(
        machine=request.machine,
        earlier=request.earlier,
        later=request.later,
        runs=(int(masks[0].sum()), int(masks[1].sum())),
        days=(days[0], days[1]),
        parameters=_with_discovery_rates(compared),
        conditions={
            name: ConditionOfPeriods(*(_mean(values[mask]) for mask in masks))
            for name, values in history.true_conditions.items()
        },
    )


def _within(history: MachineHistory, period: Period) -> npt.NDArray[np.bool_]:
    return np.array([period.since <= at < period.until for at in history.started_at], dtype=np.bool_)


def _mean(values: npt.NDArray[np.float64]) -> float | None:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else None


def _compared(
    whole: Series, campaigns: npt.NDArray[np.str_], request: PeriodsRequest, tolerance: float | None
) -> tuple[ParameterOfPeriods, BeforeAfter | None]:
    """One parameter, not yet judged among the others; its other days help to say how days differ."""
    steady = whole.steady
    steady_campaigns = campaigns[~whole.warm_up] if len(steady.values) < len(whole.values) else campaigns
    ends = [
        moment.timestamp() / SECONDS_PER_DAY
        for period in (request.earlier, request.later)
        for moment in (period.since, period.until)
    ]
    # 0 before both, 1 the earlier, 2 between, 3 the later, 4 after.
    stretch = np.searchsorted(np.array(ends), steady.t, side="right")
    first, second = steady.part(stretch == 1), steady.part(stretch == 3)
    means = [_mean_of_days(side) for side in (first, second)]
    judged = None
    rest = (stretch != 1) & (stretch != 3)
    others = steady.part(rest)
    if len(first.values) and len(second.values):
        try:
            judged = before_after(
                first.values, second.values, first.days, second.days,
                OtherDays(others.values, others.days, stretch[rest], steady_campaigns[rest]),
            )  # fmt: skip
        except DataError:
            judged = None
    parameter = ParameterOfPeriods(
        unit=whole.unit,
        earlier=means[0],
        later=means[1],
        difference=None if means[0] is None or means[1] is None else means[1] - means[0],
        u=None if judged is None else judged.u,
        k=None if judged is None else judged.k,
        p_value=None,
        q_value=None,
        differs=None,
        tolerance=tolerance,
    )
    return parameter, judged


def _mean_of_days(series: Series) -> float | None:
    if not len(series.values):
        return None
    index = np.unique(series.days, return_inverse=True)[1]
    return float((np.bincount(index, series.values) / np.bincount(index)).mean())


def _with_discovery_rates(
    compared: Mapping[str, tuple[ParameterOfPeriods, BeforeAfter | None]],
) -> dict[str, ParameterOfPeriods]:
    """The parameters judged together, since thirteen of them at 5 % each would often name one that did not change; what
    is named also has to exceed, by itself, what its days do not exclude."""
    decided = {
        name: judged for name, (_, judged) in compared.items() if judged is not None and judged.decided
    }
    p_values = {name: judged.p_value() for name, judged in decided.items()}
    rates = control_false_discoveries(list(p_values.values()), rate=RATE).q_value.tolist()
    q_values = dict(zip(p_values, rates, strict=True))
    return {
        name: replace(parameter, p_value=p_values[name], q_value=q_values[name],
                      differs=_differs(q_values[name], decided[name].p_value_of_rivals()))
        if name in decided else parameter
        for name, (parameter, _) in compared.items()
    }  # fmt: skip


def _differs(q_value: float, p_value_of_rivals: float) -> bool | None:
    """Whether a parameter differs; None where it does only if its days are independent and of one scatter."""
    if q_value > RATE:
        return False
    return True if p_value_of_rivals <= RATE else None
