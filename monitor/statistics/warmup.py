"""Warm-up as an exponential: final value + amplitude exp(-t / tau), and after how long it is over.

The time constant is found by profiling: for each tau of a fine grid the rest is a straight fit, so there is
no start value and no failed iteration; the interval of tau and of the stable time is what the profile allows.
Several days that each begin cold are one warm-up: hours since the start of the day, a level of its own for each day.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_matrix, as_positive, as_probability, as_vector

#: Time constants tried, as fractions of the span of the times: below the first, one run holds the whole
#: effect; above the last, the curve is a straight line to 1/24 of its fall and tau means nothing.
GRID = (0.005, 3.0, 400)
#: Different times that an exponential needs: five of runs that share none, four where others of the same time show
#: the scatter (level, amplitude and time constant, and one to spare).
FEWEST_TIMES = (5, 4)
#: A column that the others explain but for this share of its length is no column.
DEPENDENT = 1e-9


@dataclass(frozen=True)
class WarmUp:
    """``final`` and ``amplitude`` in the unit of the values; ``tau`` and ``stable_after`` in that of the times.

    ``p_value`` is that of there being no such exponential, the search over tau allowed for. An upper end of
    infinity says that the times do not bound it. ``tolerance`` is the remaining amplitude called stable. ``span`` is
    from the first time to the last.
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
    span: float

    @property
    def settles(self) -> bool:
        """Whether a curve that bends within the times seen agrees with the values, rather than straight lines alone."""
        return self.tau_interval[0] <= self.span or self.tau_is_known

    @property
    def tau_is_known(self) -> bool:
        """Whether tau says more than that the values go along a line: within the span, or bounded above."""
        return self.tau <= self.span or bool(np.isfinite(self.tau_interval[1]))

    @property
    def share_seen(self) -> float:
        """Share of the amplitude that passed between the first time and the last; the rest is extrapolated."""
        return -float(np.expm1(-self.span / self.tau))


@dataclass(frozen=True)
class _Profile:
    """The fits for every time constant; ``base`` (n, k) spans what is fitted beside the exponential."""

    base: Array
    tau: Array
    unit: Array
    norm: Array
    rss: Array
    amplitude: Array
    unexplained: float


def _basis(columns: Array) -> Array:
    """Orthonormal basis (n, k) of what columns (n, e) span; those that the others explain add nothing."""
    vectors, sizes, _ = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
    return np.asarray(vectors[:, sizes > DEPENDENT * sizes[0]])


def _profile(y: Array, t: Array, weight: Array, beside: Array) -> _Profile:
    """For every tau of the grid: the exponential's part that a constant and ``beside`` do not have, and the fit."""
    span = float(np.ptp(t))
    tau = span * np.geomspace(*GRID[:2], GRID[2])
    root = np.sqrt(weight)[:, np.newaxis]
    base = _basis(root * np.column_stack([np.ones_like(t), beside]))
    whole = root * np.exp(-(t - t.min())[:, np.newaxis] / tau)
    shape = whole - base @ (base.T @ whole)
    norm = np.sqrt((shape**2).sum(axis=0))
    if (norm <= DEPENDENT * np.sqrt((whole**2).sum(axis=0))).any():
        raise DataError("what is fitted beside the exponential explains it; no warm-up can be told from it.")
    unit = shape / norm
    wanted = root[:, 0] * y
    wanted = wanted - base @ (base.T @ wanted)
    along = unit.T @ wanted
    total = float(wanted @ wanted)
    return _Profile(base, tau, unit, norm, np.maximum(total - along**2, 0.0), along / norm, total)


def _p_value(profile: _Profile, rng: np.random.Generator, trials: int) -> float:
    """Share of noise in which the best of all time constants explains as much."""
    n = len(profile.unit)
    if profile.unexplained == 0.0:
        return 1.0
    draws = rng.standard_normal((n, trials))
    # The units lie in the space without what stands beside them: the noise in it is all that counts.
    base = profile.base
    draws -= base @ (base.T @ draws)
    best = ((profile.unit.T @ draws) ** 2).max(axis=0) / (draws**2).sum(axis=0)
    explained = 1.0 - profile.rss.min() / profile.unexplained
    return float((1 + (best >= explained).sum()) / (trials + 1))


def warm_up(
    values: npt.ArrayLike,
    times: npt.ArrayLike,
    *,
    rng: np.random.Generator,
    u: npt.ArrayLike | None = None,
    beside: npt.ArrayLike | None = None,
    tolerance: float | None = None,
    level: float = 0.95,
    trials: int = 1999,
) -> WarmUp:
    """Exponential warm-up of ``values`` (n,) over ``times`` (n,) since the machine was started.

    ``tolerance`` (unit of the values) is the remaining drift called stable; None takes the scatter of one run.
    ``u`` (n,) weighs the runs. ``beside`` (n, e) are columns that are fitted beside it, such as the levels of days
    that each begin cold, or a step that was found; the p-value allows for them. ``amplitude`` is that at the first
    time. Raises ``DataError`` for fewer than 6 runs, 4 different times (5 where no two runs share one), fewer runs
    than are fitted, columns that explain the exponential, a tolerance not above zero, non-finite values.
    Intervals: profile of the residual sum of squares against F with 1 and n - 3 degrees of freedom, less one for each
    independent column beside it.
    """
    y = as_vector(values, "values", least=6)
    t = as_vector(times, "times", length=len(y))
    different = len(np.unique(t))
    needed = FEWEST_TIMES[0] if different == len(t) else FEWEST_TIMES[1]
    if different < needed:
        raise DataError(f"times has {different} different values; an exponential needs at least {needed}.")
    columns = np.empty((len(y), 0)) if beside is None else as_matrix(beside, "beside")
    if len(columns) != len(y):
        raise DataError(f"beside has {len(columns)} rows; {len(y)} are needed, one for each run.")
    if tolerance is not None and not tolerance > 0.0:
        raise DataError(f"tolerance is {tolerance}; it must be above zero.")
    if trials < 99:
        raise DataError(f"trials is {trials}; at least 99 are needed for a p-value of 0.01.")
    as_probability(level, "level")
    weight = np.ones_like(y) if u is None else 1.0 / as_positive(u, "u", length=len(y)) ** 2
    weight = weight / weight.mean()
    profile = _profile(y, t, weight, columns)
    best = int(profile.rss.argmin())
    dof = len(y) - profile.base.shape[1] - 2
    if dof < 1:
        raise DataError(f"{len(y)} runs are too few for an exponential beside {columns.shape[1]} columns.")
    variance = float(profile.rss[best]) / dof
    allowed = profile.rss[best] + variance * scipy.special.fdtri(1, dof, level)
    inside = np.flatnonzero(profile.rss <= allowed)
    low = 0.0 if inside[0] == 0 else float(profile.tau[inside[0]])
    high = np.inf if inside[-1] == len(profile.tau) - 1 else float(profile.tau[inside[-1]])
    amplitude, tau = float(profile.amplitude[best]), float(profile.tau[best])
    sd = float(np.sqrt(variance))
    limit = tolerance if tolerance is not None else sd
    shape = np.exp(-(t - t.min()) / tau)
    final = float(np.average(y - amplitude * shape, weights=weight))
    first = float(t.min())
    half = np.sqrt(allowed - profile.rss[inside]) / profile.norm[inside]
    size = np.abs(profile.amplitude[inside])
    shortest = _stable(profile.tau[inside], np.maximum(size - half, 0.0), limit).min()
    longest = np.inf if np.isinf(high) else _stable(profile.tau[inside], size + half, limit).max()
    return WarmUp(
        final=final,
        amplitude=amplitude,
        u_amplitude=sd / float(profile.norm[best]),
        tau=tau,
        tau_interval=(low, high),
        p_value=_p_value(profile, rng, trials),
        stable_after=first + float(_stable(np.array([tau]), np.array([abs(amplitude)]), limit)[0]),
        stable_interval=(first + float(shortest), first + float(longest)),
        tolerance=limit,
        residual_sd=sd,
        level=level,
        trials=trials,
        span=float(np.ptp(t)),
    )


def _stable(tau: Array, size: Array, limit: float) -> Array:
    """Time from the first run until the remaining amplitude is ``limit``; zero where it is less already."""
    if limit == 0.0:
        return np.full_like(tau, np.inf)
    return np.asarray(tau * np.log(np.maximum(size / limit, 1.0)))
