"""Warm-up as an exponential: final value + amplitude exp(-t / tau), and after how long it is over.

The time constant is found by profiling: for each tau of a fine grid the rest is a straight fit, so there is
no start value and no failed iteration; the interval of tau and of the stable time is what the profile allows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_positive, as_probability, as_vector

#: Time constants tried, as fractions of the span of the times: below the first, one run holds the whole
#: effect; above the last, the curve is a straight line to 1/24 of its fall and tau means nothing.
GRID = (0.005, 3.0, 400)


@dataclass(frozen=True)
class WarmUp:
    """``final`` and ``amplitude`` in the unit of the values; ``tau`` and ``stable_after`` in that of the times.

    ``p_value`` is that of there being no such exponential, the search over tau allowed for. An upper end of
    infinity says that the times do not bound it. ``tolerance`` is the remaining amplitude called stable.
    """

    final: float
    amplitude: float
    u_amplitude: float
    tau: float
    tau_interval: tuple[float, float]
    p_value: float
    stable_after: float
    stable_interval: tuple[float, float]
    tolerance: float
    residual_sd: float
    level: float
    trials: int


@dataclass(frozen=True)
class _Profile:
    tau: Array
    unit: Array
    norm: Array
    rss: Array
    amplitude: Array
    unexplained: float


def _profile(y: Array, t: Array, weight: Array) -> _Profile:
    """For every tau of the grid: the exponential's part that a constant does not have, and the fit."""
    span = float(np.ptp(t))
    tau = span * np.geomspace(*GRID[:2], GRID[2])
    root = np.sqrt(weight)
    base = root / np.sqrt(weight.sum())
    shape = root[:, np.newaxis] * np.exp(-(t - t.min())[:, np.newaxis] / tau)
    shape -= np.outer(base, base @ shape)
    norm = np.sqrt((shape**2).sum(axis=0))
    unit = shape / norm
    wanted = root * y
    wanted = wanted - base * (base @ wanted)
    along = unit.T @ wanted
    total = float(wanted @ wanted)
    return _Profile(tau, unit, norm, np.maximum(total - along**2, 0.0), along / norm, total)


def _p_value(profile: _Profile, rng: np.random.Generator, trials: int) -> float:
    """Share of noise in which the best of all time constants explains as much."""
    n = len(profile.unit)
    if profile.unexplained == 0.0:
        return 1.0
    draws = rng.standard_normal((n, trials))
    weighted = profile.unit
    # The units lie in the space without the constant; a chi-square of n - 1 is all that is left of the noise.
    base = _constant(weighted)
    draws -= np.outer(base, base @ draws)
    best = ((weighted.T @ draws) ** 2).max(axis=0) / (draws**2).sum(axis=0)
    explained = 1.0 - profile.rss.min() / profile.unexplained
    return float((1 + (best >= explained).sum()) / (trials + 1))


def _constant(unit: Array) -> Array:
    """Any unit vector outside the span of the profile's columns (the weighted constant)."""
    left_vectors, _, _ = np.linalg.svd(unit, full_matrices=True)
    return np.asarray(left_vectors[:, -1])


def warm_up(
    values: npt.ArrayLike,
    times: npt.ArrayLike,
    *,
    rng: np.random.Generator,
    u: npt.ArrayLike | None = None,
    tolerance: float | None = None,
    level: float = 0.95,
    trials: int = 1999,
) -> WarmUp:
    """Exponential warm-up of ``values`` (n,) over ``times`` (n,) since the machine was started.

    ``tolerance`` (unit of the values) is the remaining drift called stable; None takes the scatter of one run.
    ``u`` (n,) weighs the runs. ``amplitude`` is that at the first time. Raises ``DataError`` for fewer than 6
    runs or 5 different times, a tolerance not above zero, non-finite values. Intervals: profile of the
    residual sum of squares against F with 1 and n - 3 degrees of freedom.
    """
    y = as_vector(values, "values", least=6)
    t = as_vector(times, "times", length=len(y))
    if len(np.unique(t)) < 5:
        raise DataError(f"times has {len(np.unique(t))} different values; an exponential needs at least 5.")
    if tolerance is not None and not tolerance > 0.0:
        raise DataError(f"tolerance is {tolerance}; it must be above zero.")
    if trials < 99:
        raise DataError(f"trials is {trials}; at least 99 are needed for a p-value of 0.01.")
    as_probability(level, "level")
    weight = np.ones_like(y) if u is None else 1.0 / as_positive(u, "u", length=len(y)) ** 2
    weight = weight / weight.mean()
    profile = _profile(y, t, weight)
    n, best = len(y), int(profile.rss.argmin())
    variance = float(profile.rss[best]) / (n - 3)
    allowed = profile.rss[best] + variance * scipy.special.fdtri(1, n - 3, level)
    inside = np.flatnonzero(profile.rss <= allowed)
    low = 0.0 if inside[0] == 0 else float(profile.tau[inside[0]])
    high = np.inf if inside[-1] == len(profile.tau) - 1 else float(profile.tau[inside[-1]])
    amplitude, tau = float(profile.amplitude[best]), float(profile.tau[best])
    sd = float(np.sqrt(variance))
    limit = tolerance if tolerance is not None else sd
    shape = np.exp(-(t - t.min()) / tau)
    design = np.sqrt(weight)[:, np.newaxis] * np.column_stack([np.ones(n), shape])
    covariance = variance * np.linalg.inv(design.T @ design)
    final = float(np.average(y - amplitude * shape, weights=weight))
    first = float(t.min())
    half = np.sqrt(allowed - profile.rss[inside]) / profile.norm[inside]
    size = np.abs(profile.amplitude[inside])
    shortest = _stable(profile.tau[inside], np.maximum(size - half, 0.0), limit).min()
    longest = np.inf if np.isinf(high) else _stable(profile.tau[inside], size + half, limit).max()
    return WarmUp(
        final=final,
        amplitude=amplitude,
        u_amplitude=float(np.sqrt(covariance[1, 1])),
        tau=tau,
        tau_interval=(low, high),
        p_value=_p_value(profile, rng, trials),
        stable_after=first + float(_stable(np.array([tau]), np.array([abs(amplitude)]), limit)[0]),
        stable_interval=(first + float(shortest), first + float(longest)),
        tolerance=limit,
        residual_sd=sd,
        level=level,
        trials=trials,
    )


def _stable(tau: Array, size: Array, limit: float) -> Array:
    """Time from the first run until the remaining amplitude is ``limit``; zero where it is less already."""
    if limit == 0.0:
        return np.full_like(tau, np.inf)
    return np.asarray(tau * np.log(np.maximum(size / limit, 1.0)))
