"""What a parameter depends on: temperature, warm-up time, any recorded channel, cycles of day and year.

All coefficients are estimated together with the drift, so a machine that was measured in ever warmer weeks
shows neither as the other; where they cannot be separated the correlation of the estimates says so.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_positive, as_probability, as_vector
from monitor.statistics.mixed import MixedFit, fit_with_days
from monitor.statistics.sums import label_groups
from monitor.units import DEGREE_CELSIUS, KELVIN, Unit


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


def _per(unit: Unit | None, channel: Unit | None) -> Unit | None:
    """Unit of a coefficient; per kelvin where the channel is a Celsius temperature."""
    if unit is None or channel is None:
        return None
    return unit.per(KELVIN if channel == DEGREE_CELSIUS else channel)


def _design(
    t: Array, channels: Mapping[str, npt.ArrayLike], cycles: Mapping[str, float], drift: bool
) -> tuple[tuple[str, ...], Array]:
    """Return the names of the q terms and their columns (n, q): level, drift, channels, cosine and sine of cycles."""
    origin = float(t.mean())
    terms, columns = ["level"], [np.ones_like(t)]
    if drift:
        if np.ptp(t) == 0.0:
            raise DataError(f"all times are {t[0]}; leave out the drift or give times that differ.")
        terms.append("drift")
        columns.append(t - origin)
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
    drift: bool = True,
    u: npt.ArrayLike | None = None,
    days: npt.ArrayLike | None = None,
    unit: Unit | None = None,
    channel_units: Mapping[str, Unit] | None = None,
    level: float = 0.95,
) -> Dependence:
    """Coefficients of ``values`` (n,) on ``channels`` (each (n,)) and on ``cycles`` (name to period).

    ``times`` and the periods share any unit; ``u`` and ``days`` as in ``trend``. A coefficient's unit is
    ``unit`` per channel unit (µm/m per °C becomes µm/m/K); one that was given neither has none. Raises
    ``DataError`` for a channel that never varies, terms that are exactly dependent, a cycle seen over less
    than half its period, too few runs, or non-finite values. Errors in the channels themselves are
    neglected: they pull a coefficient towards zero by the ratio of their variance to that of the channel.
    """
    y = as_vector(values, "values", least=4)
    t = as_vector(times, "times", length=len(y))
    as_probability(level, "level")
    run_u = None if u is None else as_positive(u, "u", length=len(y))
    index = np.arange(len(y)) if days is None else label_groups(days, len(y))[1]
    origin = float(t.mean())
    terms, design = _design(t, channels, cycles or {}, drift)
    fit = fit_with_days(y, design, run_u, index)
    weight = np.ones_like(y) if run_u is None else 1.0 / run_u**2
    about = y - np.average(y, weights=weight)
    total = float((weight * about**2).sum())
    units = channel_units or {}
    start = 2 if drift else 1
    scale = np.outer(fit.u, fit.u)
    return Dependence(
        coefficients=tuple(
            _coefficient(fit, start + i, name, _per(unit, units.get(name)), level)
            for i, name in enumerate(channels)
        ),
        cycles=tuple(
            _cycle(fit, start + len(channels) + 2 * i, name, period, origin)
            for i, (name, period) in enumerate((cycles or {}).items())
        ),
        drift=_coefficient(fit, 1, "drift", None, level) if drift else None,
        terms=terms,
        correlation=fit.covariance / np.where(scale > 0.0, scale, 1.0),
        explained=1.0 - float((weight * fit.residual**2).sum()) / total if total > 0.0 else 0.0,
        within=fit.within,
        between=fit.between,
        level=level,
    )
