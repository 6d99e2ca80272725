"""When will a parameter leave its tolerance: date with interval, probability at the next check, interval.

Extrapolates the drift of ``trend`` (run it on the piece since the last change). The predicted quantity is
the result of one run on a day of its own: line, day component and scatter of the run together. How good
such forecasts were is told by ``backtest`` on history that was held out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import optimize, stats

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_positive, as_probability, as_vector
from monitor.statistics.sums import label_groups
from monitor.statistics.trend import Trend, trend

METHOD = (
    "prediction interval of the drift: the longest time after which a run is still in tolerance "
    "with the wanted probability"
)


@dataclass(frozen=True)
class Crossing:
    """Time at which the line reaches ``limit``; None where its best estimate never does.

    ``interval`` holds the times at which the confidence band of the line reaches it; the upper end is
    infinite where the band allows that it never does, and both where it certainly does not drift there.
    """

    limit: float
    at: float | None
    interval: tuple[float, float]


@dataclass(frozen=True)
class Forecast:
    """``crossing`` of the limit that is reached first (None without drift towards one).

    ``probability`` (c,) of a run in tolerance at each of ``checks`` (c,); ``recommended_interval`` is the
    time from ``now`` (infinite beyond ``horizon``), by ``method``, at ``reliability``.
    """

    now: float
    crossing: Crossing
    checks: Array
    predicted: Array
    u_predicted: Array
    probability: Array
    recommended_interval: float
    reliability: float
    horizon: float
    method: str


@dataclass(frozen=True)
class Backtest:
    """Forecasts of held-out days: ``covered`` of ``made`` runs lay in their prediction interval (``level``).

    ``bias`` and ``rms`` of observed less predicted; ``z`` (made,) the same in units of the stated uncertainty.
    """

    made: int
    covered: int
    level: float
    bias: float
    rms: float
    z: Array

    @property
    def coverage(self) -> float:
        """Share of held-out runs inside."""
        return self.covered / self.made


def predict(line: Trend, times: npt.ArrayLike) -> tuple[Array, Array, Array]:
    """Line (m,), standard uncertainty of the line (m,), and of one run on a day of its own (m,)."""
    t = np.asarray(times, dtype=np.float64) - line.at
    c = line.covariance
    of_line = np.sqrt(np.maximum(c[0, 0] + 2.0 * t * c[0, 1] + t * t * c[1, 1], 0.0))
    return line.level_at + line.slope * t, of_line, np.hypot(of_line, line.run_sd)


def _crossing(line: Trend, limit: float, now: float, horizon: float) -> Crossing:
    """First time from ``now`` on at which the line, and each side of its band, reaches the limit."""
    factor = float(stats.t.isf((1.0 - line.confidence) / 2.0, line.dof))
    side = 1.0 if limit > float(predict(line, now)[0]) else -1.0
    grid = now + np.concatenate([[0.0], np.geomspace(1e-4, 1.0, 400)]) * (horizon - now)

    def first(multiple: float) -> float:
        def gap(t: npt.ArrayLike) -> Array:
            value, u, _ = predict(line, t)
            return np.asarray(side * (limit - value) - multiple * factor * u)

        beyond = np.flatnonzero(gap(grid) <= 0.0)
        if not beyond.size:
            return np.inf
        i = int(beyond[0])
        return (
            float(grid[0])
            if i == 0
            else float(optimize.brentq(lambda t: float(gap(t)), grid[i - 1], grid[i]))
        )

    at = first(0.0)
    return Crossing(limit, None if np.isinf(at) else at, (first(1.0), first(-1.0)))


def _probability(line: Trend, times: npt.ArrayLike, lower: float, upper: float) -> Array:
    value, _, u = predict(line, times)
    scale = np.maximum(u, 1e-300)
    below = stats.t.cdf((upper - value) / scale, line.dof)
    return np.asarray(below - stats.t.cdf((lower - value) / scale, line.dof))


def forecast(
    line: Trend,
    limits: tuple[float, float],
    now: float,
    checks: npt.ArrayLike,
    *,
    reliability: float = 0.95,
    horizon: float | None = None,
) -> Forecast:
    """Forecast of a drift ``line`` against ``limits`` (lower, upper) in the unit of its values.

    ``now``, ``checks`` (c,) and ``horizon`` in the unit of its times; without a horizon ten times the span of the
    history (from its mean time to now, doubled). An open side is an infinite limit. Raises ``DataError`` for
    limits that do not rise, a check before now. Neglected: changes yet to come; see ``backtest``.
    """
    lower, upper = (float(x) for x in limits)
    if not lower < upper:
        raise DataError(f"limits is ({lower}, {upper}); the lower must be below the upper.")
    if not (np.isfinite(now) and now >= line.at):
        raise DataError(f"now is {now}; it must not lie before the mean time of the history, {line.at}.")
    at = as_vector(checks, "checks", least=0)
    if at.size and at.min() < now:
        raise DataError(f"checks holds {at.min()}; a planned check cannot lie before now, {now}.")
    as_probability(reliability, "reliability")
    end = now + 20.0 * max(now - line.at, 1e-9) if horizon is None else float(horizon)
    if not end > now:
        raise DataError(f"horizon is {end}; it must lie after now, {now}.")
    sides = [_crossing(line, x, now, end) for x in (lower, upper) if np.isfinite(x)]
    sides.sort(key=lambda c: (np.inf if c.at is None else c.at, c.interval[0]))
    grid = now + np.concatenate([[0.0], np.geomspace(1e-4, 1.0, 2000)]) * (end - now)
    out = np.flatnonzero(_probability(line, grid, lower, upper) < reliability)
    value, _, u = predict(line, at)
    return Forecast(
        now=now,
        crossing=sides[0] if sides else Crossing(np.inf, None, (np.inf, np.inf)),
        checks=at,
        predicted=value,
        u_predicted=u,
        probability=_probability(line, at, lower, upper),
        recommended_interval=np.inf if not out.size else float(grid[max(int(out[0]) - 1, 0)] - now),
        reliability=reliability,
        horizon=end,
        method=METHOD,
    )


def backtest(
    values: npt.ArrayLike,
    times: npt.ArrayLike,
    *,
    u: npt.ArrayLike | None = None,
    days: npt.ArrayLike | None = None,
    ahead: int = 1,
    first: int = 5,
    level: float = 0.95,
) -> Backtest:
    """Forecasts each day from the ``first`` on by what was known ``ahead`` days before it.

    Arguments as in ``trend``. Only the first run of a forecast day counts, so that the counted errors are
    not copies of one day's. Raises ``DataError`` where the history has fewer than first + ahead days.
    """
    y = as_vector(values, "values", least=3)
    t = as_vector(times, "times", length=len(y))
    own = None if u is None else as_positive(u, "u", length=len(y))
    as_probability(level, "level")
    index = np.arange(len(y)) if days is None else label_groups(days, len(y))[1]
    starts = np.array([t[index == j].min() for j in range(int(index.max()) + 1)])
    order = np.argsort(starts, kind="stable")
    if first < 3 or ahead < 1:
        raise DataError(
            f"first is {first}, ahead is {ahead}; at least 3 days of history and 1 ahead are needed."
        )
    if len(order) < first + ahead:
        raise DataError(f"the history has {len(order)} days; first + ahead = {first + ahead} are needed.")
    rank = np.argsort(order)[index]
    z, errors, inside = [], [], 0
    for day in range(first + ahead - 1, len(order)):
        past = rank <= day - ahead
        target = int(np.flatnonzero(rank == day)[0])
        known = None if own is None else own[past]
        line = trend(y[past], t[past], u=known, days=index[past], level=level, ranks=False)
        value, _, spread = predict(line, t[target])
        error = float(y[target] - value)
        errors.append(error)
        z.append(error / max(float(spread), 1e-300))
        inside += abs(z[-1]) <= stats.t.isf((1.0 - level) / 2.0, line.dof)
    e = np.array(errors)
    return Backtest(len(e), int(inside), level, float(e.mean()), float(np.sqrt((e**2).mean())), np.array(z))
