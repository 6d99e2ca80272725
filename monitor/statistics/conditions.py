"""What a parameter depends on: temperature, warm-up time, any recorded channel, cycles of day and year.

All coefficients are estimated together with the drift, so a machine that was measured in ever warmer weeks
shows neither as the other; where they cannot be separated the correlation of the estimates says so. Days that resemble
each other are allowed for, as in ``trend``: what follows the weather follows it for days.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_matrix, as_positive, as_vector
from monitor.statistics.days.block_lines import Blocks, block_count, block_lines, block_of
from monitor.statistics.groups import independent_columns
from monitor.statistics.mixed import MixedFit, fit_with_days
from monitor.statistics.sums import label_groups
from monitor.units import DEGREE_CELSIUS, KELVIN, Unit

#: Confidence of the intervals of coefficients.
LEVEL = 0.95


@dataclass(frozen=True)
class Coefficient:
    """Change of the parameter for one unit of the channel; ``unit`` is None where none was passed in."""

    name: str
    value: float
    u: float
    interval: tuple[float, float]
    dof: float
    p_value: float
    unit: Unit | None


@dataclass(frozen=True)
class Cycle:
    """A cycle ``amplitude cos(2 pi (t - peak_at) / period)``; the p-value is that of having no such cycle."""

    name: str
    period: float
    amplitude: float
    u: float
    peak_at: float
    p_value: float


@dataclass(frozen=True)
class Dependence:
    """Coefficients on channels, cycles and the drift beside them (None where it was not asked for).

    ``correlation`` (q, q) is that of the estimates in the order ``terms``; ``explained`` the share of the
    weighted sum of squares about the mean; ``between`` the day component that remains.
    """

    coefficients: tuple[Coefficient, ...]
    cycles: tuple[Cycle, ...]
    drift: Coefficient | None
    terms: tuple[str, ...]
    correlation: Array
    explained: float
    within: float
    between: float
    level: float


def _coefficient(fit: MixedFit, at: int, name: str, unit: Unit | None, level: float) -> Coefficient:
    low, high = fit.interval(level)[at]
    value, u, dof, p = fit.coefficients[at], fit.u[at], fit.dof[at], fit.p_value[at]
    return Coefficient(name, float(value), float(u), (float(low), float(high)), float(dof), float(p), unit)


def _cycle(fit: MixedFit, at: int, name: str, period: float, origin: float) -> Cycle:
    pair = fit.coefficients[at : at + 2]
    block = fit.covariance[at : at + 2, at : at + 2]
    amplitude = float(np.hypot(*pair))
    direction = pair / amplitude if amplitude > 0.0 else np.array([1.0, 0.0])
    f = float(pair @ np.linalg.solve(block, pair)) / 2.0
    dof = float(fit.dof[at : at + 2].min())
    peak = origin + float(np.arctan2(pair[1], pair[0])) / (2.0 * np.pi) * period
    u = float(np.sqrt(direction @ block @ direction))
    return Cycle(name, period, amplitude, u, peak, float(scipy.special.fdtrc(2.0, dof, f)))


@dataclass(frozen=True)
class DependenceUnits:
    """The unit of the ``values`` and those of the channels, by name: a coefficient has one where both are stated."""

    values: Unit
    channels: Mapping[str, Unit]


def _unit_of(units: DependenceUnits | None, channel: str) -> Unit | None:
    return None if units is None else _per(units.values, units.channels.get(channel))


def _per(unit: Unit | None, channel: Unit | None) -> Unit | None:
    """Unit of a coefficient; per kelvin where the channel is a Celsius temperature."""
    if unit is None or channel is None:
        return None
    return unit.per(KELVIN if channel == DEGREE_CELSIUS else channel)


#: Blocks of a period of a cycle: longer ones would average it away. Beyond so many blocks, as of the cycle of the day
#: over a year, the slow resemblance of days has next to no part in a cycle so fast, and they are taken as independent.
BLOCKS_OF_PERIOD, MOST_BLOCKS = 10, 200


def _widened(
    fit: MixedFit,
    design: Array,
    day: npt.NDArray[np.intp],
    t: Array,
    periods: Sequence[float | None],
    first: int,
) -> MixedFit:
    """The fit with covariance and degrees of freedom for days that resemble their neighbours.

    Of every coefficient the part of its variance that rests on the days is widened as the slope of a line over its own
    column is, beside all others (``block_lines``). Left as it is where so few days allow no such line. ``periods`` (q,)
    are those of the columns that are waves; of the columns before ``first`` nobody asks the uncertainty.
    """
    count = np.bincount(day)
    order = np.argsort(np.bincount(day, t) / count, kind="stable")
    means = np.column_stack([np.bincount(day, column) / count for column in design.T])[order]
    residual = (np.bincount(day, fit.residual) / count)[order]
    times = (np.bincount(day, t) / count)[order]
    weight = fit.weight[order]
    factor, dof = np.ones(len(fit.coefficients)), fit.dof.copy()
    by_day = _mean_square(np.arange(len(times)), weight, means, residual)
    for at in range(first, design.shape[1]):
        block = _blocks_of(times, periods[at])
        if block is None:
            continue
        # Blocks of several days scatter more than as many independent days would.
        by_block = _mean_square(block, weight, means, residual)
        swollen = max(by_block / by_day, 1.0) if by_day > 0.0 and np.isfinite(by_block) else 1.0
        beside = np.delete(means, [0, at], axis=1)
        lines = block_lines(_cut(block, weight, means[:, at], residual, beside))
        widening, freedom = float(lines.widening[0]), float(lines.dof[0])
        if not np.isfinite(widening):
            continue
        inside = fit.inside[at]
        of_days = (1.0 - inside) * max(widening**2, 1.0) * swollen
        factor[at] = np.sqrt(inside + of_days)
        within = inside**2 / max(len(day) - len(count), 1) + of_days**2 / min(freedom, max(fit.dof[at], 1.0))
        dof[at] = np.clip(factor[at] ** 4 / within, 1.0, fit.dof[at])
    return replace(fit, covariance=fit.covariance * np.outer(factor, factor), dof=dof)


def _mean_square(block: npt.NDArray[np.intp], weight: Array, columns: Array, value: Array) -> float:
    """Mean square of what weighted means of blocks leave over columns (d, q), ``block`` (d,) of each day; or NaN."""
    total = np.asarray(np.bincount(block, weight), dtype=np.float64)
    both = np.column_stack([np.bincount(block, weight * column) for column in (*columns.T, value)])
    rows = both / np.sqrt(total)[:, np.newaxis]
    solution, _, rank, _ = np.linalg.lstsq(rows[:, :-1], rows[:, -1], rcond=1e-9)
    free = len(rows) - int(rank)
    return float(((rows[:, -1] - rows[:, :-1] @ solution) ** 2).sum()) / free if free > 0 else np.nan


def _blocks_of(times: Array, period: float | None) -> npt.NDArray[np.intp] | None:
    """Block (d,) of each day in the order of time, from 0, none empty; None where a cycle needs too many of them."""
    count = int(block_count(len(times)))
    if period is not None:
        count = max(count, int(np.ceil(BLOCKS_OF_PERIOD * np.ptp(times) / period)))
        if count > MOST_BLOCKS:
            return None
    index = block_of(times, count, float(times.min()), float(times.max()))
    return np.asarray(np.unique(index, return_inverse=True)[1])


def _cut(block: npt.NDArray[np.intp], weight: Array, along: Array, value: Array, beside: Array) -> Blocks:
    """Blocks whose line goes along a column instead of time."""
    total = np.asarray(np.bincount(block, weight), dtype=np.float64)

    def mean(column: Array) -> Array:
        return np.asarray(np.bincount(block, weight * column) / total)[np.newaxis]

    columns = np.stack([mean(column) for column in beside.T], axis=2) if beside.shape[1] else None
    return Blocks(total[np.newaxis], mean(along), mean(value), np.array([float(len(block))]), columns)


def _design(
    t: Array, beside: Array, channels: Mapping[str, npt.ArrayLike], cycles: Mapping[str, float], drift: bool
) -> tuple[tuple[str, ...], Array]:
    """Return the names of the q terms and their columns (n, q): level, drift, those beside, channels, cosine and sine
    of cycles."""
    origin = float(t.mean())
    terms, columns = ["level"], [np.ones_like(t)]
    if drift:
        if np.ptp(t) == 0.0:
            raise DataError(f"all times are {t[0]}; leave out the drift or give times that differ.")
        terms.append("drift")
        columns.append(t - origin)
    explained = independent_columns(np.column_stack([*columns, beside]))[len(columns) :]
    for index in explained:
        terms.append(f"beside {index - len(columns) + 1}")
        columns.append(beside[:, index - len(columns)])
    for name, recorded in channels.items():
        channel = as_vector(recorded, f"channel {name}", length=len(t))
        if np.ptp(channel) == 0.0:
            raise DataError(f"channel {name} is {channel[0]} in every run; nothing can depend on it.")
        terms.append(name)
        columns.append(channel - channel.mean())
    for name, period in cycles.items():
        if not 0.0 < period <= 2.0 * np.ptp(t):
            raise DataError(
                f"cycle {name} has period {period}; the times span {np.ptp(t)}, half of it is needed."
            )
        terms += [f"{name} cosine", f"{name} sine"]
        angle = 2.0 * np.pi * (t - origin) / period
        columns += [np.cos(angle), np.sin(angle)]
    return tuple(terms), np.column_stack(columns)


def dependence(
    values: npt.ArrayLike,
    times: npt.ArrayLike,
    channels: Mapping[str, npt.ArrayLike],
    *,
    cycles: Mapping[str, float] | None = None,
    drift: bool | Literal["beside"] = True,
    u: npt.ArrayLike | None = None,
    days: npt.ArrayLike | None = None,
    units: DependenceUnits | None = None,
    independent: bool = False,
    beside: npt.ArrayLike | None = None,
) -> Dependence:
    """Coefficients of ``values`` (n,) on ``channels`` (each (n,)) and on ``cycles`` (name to period).

    A drift that is only fitted ``"beside"`` them is not reported, and its own uncertainty, half of the work beside one
    channel, not computed; nor are those of the columns ``beside`` (n, e), of groups of runs that are off together.
    ``times`` and the periods share any unit; ``u`` and ``days`` as in ``trend``. A coefficient's
    unit is that of the values per channel unit (µm/m per °C becomes µm/m/K); without ``units`` it has none. Raises
    ``DataError`` for a channel that never varies, terms that are exactly dependent, a cycle seen over less
    than half its period, too few runs, or non-finite values. Errors in the channels themselves are
    neglected: they pull a coefficient towards zero by the ratio of their variance to that of the channel.
    Days that resemble each other are allowed for, unless they are known to be ``independent``. Measured false alarms:
    docs/trials-statistics.md.
    """
    y = as_vector(values, "values", least=4)
    t = as_vector(times, "times", length=len(y))
    run_u = None if u is None else as_positive(u, "u", length=len(y))
    index = np.arange(len(y)) if days is None else label_groups(days, len(y))[1]
    origin = float(t.mean())
    cycles = cycles or {}
    columns = np.empty((len(y), 0)) if beside is None else as_matrix(beside, "beside")
    terms, design = _design(t, columns, channels, cycles, bool(drift))
    start = design.shape[1] - len(channels) - 2 * len(cycles)
    fit = fit_with_days(y, design, run_u, index)
    if not independent:
        waves = [period for period in cycles.values() for _ in range(2)]
        periods = [None] * (design.shape[1] - len(waves)) + waves
        fit = _widened(fit, design, index, t, periods, 1 if drift is True else start)
    weight = np.ones_like(y) if run_u is None else 1.0 / run_u**2
    about = y - np.average(y, weights=weight)
    total = float((weight * about**2).sum())
    scale = np.outer(fit.u, fit.u)
    return Dependence(
        coefficients=tuple(
            _coefficient(fit, start + i, name, _unit_of(units, name), LEVEL)
            for i, name in enumerate(channels)
        ),
        cycles=tuple(
            _cycle(fit, start + len(channels) + 2 * i, name, period, origin)
            for i, (name, period) in enumerate(cycles.items())
        ),
        drift=_coefficient(fit, 1, "drift", None, LEVEL) if drift is True else None,
        terms=terms,
        correlation=fit.covariance / np.where(scale > 0.0, scale, 1.0),
        explained=1.0 - float((weight * fit.residual**2).sum()) / total if total > 0.0 else 0.0,
        within=fit.within,
        between=fit.between,
        level=LEVEL,
    )
