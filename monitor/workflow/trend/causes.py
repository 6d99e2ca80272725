"""What a parameter goes with: recorded conditions, the hour of the day, the season. A part of `monitor trend`.

Where several instruments measured, each may be off by its own amount: a cause is what goes with it within the runs of
each. What does not, since each measured at its own temperature or hour, or in too few campaigns, is not decided.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.confounding import Confounding, MeasuredAt
from monitor.reporting.lacks import Cause, Lack, Part, refused
from monitor.statistics import Coefficient, DependenceUnits, dependence
from monitor.statistics.days.wandering_days import slope_as_far
from monitor.statistics.groups import group_columns, independent_columns, share_within
from monitor.units import DAYS_PER_YEAR, DEGREE_CELSIUS, ONE, Unit, column_unit
from monitor.workflow.history.calendar import date
from monitor.workflow.history.series import Series
from monitor.workflow.trend.answer import ConditionEffect, Cycle
from monitor.workflow.trend.parameter import number

#: A cycle is fitted where its phases are seen: runs over half a day, and over the better part of a year.
DAY_COVERAGE_H, YEAR_COVERAGE_D = 12.0, 300.0
#: A dependence needs so many runs with the condition; a cycle so many, by its name.
FEWEST_RUNS, FEWEST_OF_CYCLE = 6, {"day": 8, "year": 12}
#: Channels that go together more closely than this cannot be told apart (their variances inflate tenfold).
COLLINEAR = 0.95
#: Coefficients within and between days contradict each other where chance would part them so far this seldom.
CONTRADICT = 0.001
#: Degrees of freedom that the campaigns of several instruments have to leave for a cause that campaigns differ in.
ENOUGH = 2
#: What stands for the instruments among the channels.
METHOD = "method "


@dataclass(frozen=True)
class _Beside:
    """What is fitted beside a cause: the instruments' ``columns`` (n, k), None for one instrument; ``labels`` (n,) of
    the runs that are off together; ``why_not`` where the instruments and the cause cannot be told apart."""

    columns: Array | None
    labels: npt.NDArray[np.int64]
    why_not: Confounding | None = None


def _beside(part: Series, cause: Array, values: Array, unit: str) -> _Beside:
    """What measured the runs (n,) beside the columns (n, k) of a cause, which had the ``values`` (n,) in ``unit``."""
    if not part.has_several_instruments or part.campaign is None:
        return _Beside(None, part.days)
    weights = part.weights()
    weight = None if weights is None else 1.0 / weights**2
    least = 1.0 - COLLINEAR**2
    if share_within(cause, part.campaign, weight) >= least:
        return _Beside(group_columns(part.measured), part.days)
    # Campaigns differ in the cause, and every set-up is off by something.
    first = np.unique(part.campaign, return_index=True)[1]
    index = np.unique(part.campaign, return_inverse=True)[1]
    time = (np.bincount(index, part.t) / np.bincount(index))[:, np.newaxis]
    by_campaign = np.column_stack(
        [np.ones(len(first)), group_columns(part.measured)[first], time - time.mean()]
    )
    free = len(first) - len(independent_columns(by_campaign)) - cause.shape[1]
    if free >= ENOUGH and share_within(cause, part.measured, weight) >= least:
        return _Beside(group_columns(part.measured), part.campaign.astype(np.int64))
    measured = tuple(
        MeasuredAt(part.instruments[by], float(of.min()), float(of.max()))
        for by in np.unique(part.measured).tolist()
        for of in [values[part.measured == by]]
    )
    return _Beside(None, part.days, Confounding(measured, unit, max(ENOUGH - free, 2)))


def conditions(
    series: Series, channels: Mapping[str, Array], since: float
) -> tuple[tuple[ConditionEffect, ...], Lack | None]:
    """Coefficients of the conditions, one at a time beside the drift and the instruments; or why there are none.

    One at a time because the channels of one campaign move together: a joint fit of four thermometers would
    tell nothing of any of them.
    """
    piece = series.t >= since
    effects = [
        effect
        for name in channels
        if (effect := _condition(series, name, channels, piece & np.isfinite(channels[name]))) is not None
    ]
    if not effects:
        return (), Lack(Part.CONDITIONS, Cause.NOTHING_VARIES)
    return tuple(sorted(effects, key=lambda effect: 2.0 if effect.p_value is None else effect.p_value)), None


def _condition(
    series: Series, name: str, channels: Mapping[str, Array], mask: npt.NDArray[np.bool_]
) -> ConditionEffect | None:
    """The coefficient of one condition over the runs of a mask; None where it does not vary enough."""
    values = channels[name][mask]
    if len(values) < FEWEST_RUNS or np.ptp(values) == 0.0:
        return None
    part = series.part(mask)
    channel = column_unit(name) or ONE
    beside = _Beside(None, part.days)
    if not name.startswith(METHOD):
        beside = _beside(part, values[:, np.newaxis], values, "" if channel == ONE else channel.name)
    with_drift = part.day_count >= 3
    drift: Literal["beside", False] = "beside" if with_drift else False
    try:
        fit = dependence(
            part.values, part.t, {name: values}, drift=drift, u=part.weights(), days=beside.labels,
            units=DependenceUnits(Unit(series.unit, 1.0), {name: channel}), beside=beside.columns,
        )  # fmt: skip
    except DataError:
        return None
    p_value = fit.coefficients[0].p_value
    coefficient, inside, u_inside = _apart(fit.coefficients[0], part, values, beside, drift)
    if inside is not None:
        # A slope of days that one for both hides is said at the price of two tests. What one for both showed stays:
        # days and runs contradict each other by chance so seldom that nothing is paid for it.
        p_value = min(p_value, 2.0 * coefficient.p_value)
    inseparable = [
        other for other, recorded in channels.items() if other != name and _together(values, recorded[mask])
    ]
    if with_drift and _together(values, part.t):
        inseparable.append("time")
    low, high = coefficient.interval
    per = "K" if channel == DEGREE_CELSIUS else channel.name
    unit = series.unit if channel == ONE else f"{series.unit}/{per}"
    return ConditionEffect(
        name, coefficient.value, coefficient.u, (low, high), unit, number(p_value),
        len(values), float(values.min()), float(values.max()), tuple(inseparable), None, beside.why_not,
        inside, u_inside,
    )  # fmt: skip


def _apart(
    common: Coefficient, part: Series, values: Array, beside: _Beside, drift: Literal["beside", False]
) -> tuple[Coefficient, float | None, float | None]:
    """The coefficient of a condition between days, and that within them with its u, where these contradict each other
    beyond chance; else the ``common`` one. A machine may follow the weather for days, not what a thermometer shows from
    one run to the next: a common coefficient is a mean, weighted by how well days and runs tell each."""
    if not np.array_equal(beside.labels, part.days):
        return common, None, None
    u = part.weights()
    weight = np.ones_like(values) if u is None else 1.0 / u**2
    day = np.unique(part.days, return_inverse=True)[1]
    of_day = (np.bincount(day, weight * values) / np.bincount(day, weight))[day]
    inside = values - of_day
    least = 1e-6 * np.ptp(values)
    if np.ptp(of_day) <= least or np.ptp(inside) <= least:
        return common, None, None
    try:
        fit = dependence(
            part.values, part.t, {"between": of_day, "within": inside}, drift=drift, u=u, days=part.days,
            beside=beside.columns,
        )  # fmt: skip
    except DataError:
        return common, None, None
    between, within = fit.coefficients
    variance = np.array([between.u, within.u]) ** 2
    if not variance.sum() > 0.0:
        return common, None, None
    # Welch and Satterthwaite: what days and runs tell of them is independent.
    dof = variance.sum() ** 2 / float((variance**2 / np.array([between.dof, within.dof])).sum())
    p = 2.0 * scipy.special.stdtr(dof, -abs(between.value - within.value) / np.sqrt(variance.sum()))
    if p >= CONTRADICT or _by_wandering(part, of_day, within, beside, drift=bool(drift)) >= CONTRADICT:
        return common, None, None
    return between, within.value, within.u


def _by_wandering(part: Series, of_day: Array, within: Coefficient, beside: _Beside, *, drift: bool) -> float:
    """Probability that days which wander part the slope of the days so far from that ``within`` them."""
    day = np.unique(part.days, return_inverse=True)[1]
    u = part.weights()
    weight = np.ones_like(of_day) if u is None else 1.0 / u**2
    total = np.asarray(np.bincount(day, weight), dtype=np.float64)

    def mean(column: Array) -> Array:
        return np.asarray(np.bincount(day, weight * column) / total)

    times = mean(part.t)
    others = [] if beside.columns is None else [mean(column) for column in beside.columns.T]
    columns = np.column_stack([np.ones_like(total), *([times - times.mean()] if drift else []), *others])
    design = np.column_stack([columns[:, independent_columns(columns)], mean(of_day)])
    order = np.argsort(times, kind="stable")
    return slope_as_far(
        mean(part.values)[order],
        times[order],
        design[order],
        total[order],
        within.value,
        within.u,
        within.dof,
    )


def _together(a: Array, b: Array) -> bool:
    if not np.isfinite(b).all() or np.ptp(b) == 0.0:
        return False
    return bool(abs(np.corrcoef(a, b)[0, 1]) > COLLINEAR)


def cycles(piece: Series) -> tuple[tuple[Cycle, ...], Lack | None]:
    """The cycles of day and year, where the record is long enough to see them beside the drift."""
    n = len(piece.t)
    periods = {}
    if n >= FEWEST_OF_CYCLE["day"] and np.ptp(piece.hour) >= DAY_COVERAGE_H:
        periods["day"] = 1.0
    if n >= FEWEST_OF_CYCLE["year"] and np.ptp(piece.t) >= YEAR_COVERAGE_D:
        periods["year"] = DAYS_PER_YEAR
    if not periods:
        return (), Lack(Part.CYCLES, Cause.NO_CYCLE_SEEN, needed=(DAY_COVERAGE_H, YEAR_COVERAGE_D))
    beside = _beside_waves(piece, periods)
    try:
        fit = dependence(
            piece.values, piece.t, {}, cycles=periods, drift="beside" if piece.day_count >= 3 else False,
            u=piece.weights(), days=beside.labels, beside=beside.columns,
        )  # fmt: skip
    except DataError as error:
        return (), refused(Part.CYCLES, error)
    return tuple(
        Cycle(
            wave.name, wave.period, wave.amplitude, wave.u, piece.unit, date(wave.peak_at, piece.offset),
            number(wave.p_value), None, beside.why_not,
        )
        for wave in fit.cycles
    ), None  # fmt: skip


def _beside_waves(piece: Series, periods: Mapping[str, float]) -> _Beside:
    """What measured beside all waves, which are fitted together: they say of the hours, without a wave of the day of
    the days of the history, where each measured."""
    phases = [2.0 * np.pi / period * piece.t for period in periods.values()]
    cause = np.column_stack([column for phase in phases for column in (np.cos(phase), np.sin(phase))])
    if "day" in periods:
        return _beside(piece, cause, piece.hour, "h")
    return _beside(piece, cause, piece.t - piece.t[0], "d")
