"""When will a parameter leave its tolerance: date with interval, probability at the next check, interval.

Extrapolates the drift of ``trend`` (run it on the piece since the last change). The predicted quantity is
the result of one run on a day of its own: line, day component and scatter of the run together. How good
such forecasts were is reported by ``backtest`` on history that was held out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_probability, as_vector
from monitor.statistics.trend import Trend

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
    time from ``origin`` (infinite beyond ``horizon``), by ``method``, at ``reliability``.
    """

    origin: float
    crossing: Crossing
    checks: Array
    predicted: Array
    probability: Array
    recommended_interval: float
    reliability: float
    horizon: float
    method: str


def predict(line: Trend, times: npt.ArrayLike) -> tuple[Array, Array, Array]:
    """Line (m,), standard uncertainty of the line (m,), and of one run on a day of its own (m,).

    What a season may be of the slope counts from the last run on: up to there it was seen. What runs have in common,
    which no scatter about the line shows, is a part of both.
    """
    t = np.asarray(times, dtype=np.float64) - line.at
    c = line.covariance
    of_season = 0.0 if line.season_ahead is None else line.season_ahead.at(times)
    of_level = np.maximum(c[0, 0] + 2.0 * t * c[0, 1] + t * t * c[1, 1], 0.0) + line.u_common(times) ** 2
    of_line = np.hypot(np.sqrt(of_level), of_season)
    return line.level_at + line.slope * t, of_line, np.hypot(of_line, line.run_sd)


def _crossing(line: Trend, limit: float, side: float, origin: float, horizon: float) -> Crossing:
    """Return the first time from ``origin`` on at which the line, and each side of its band, reaches the limit.

    ``side`` is 1.0 for an upper and -1.0 for a lower limit: a line that lies beyond it has reached it, at
    ``origin``, and does not reach it when it comes back.
    """
    factor = float(-scipy.special.stdtrit(line.dof, (1.0 - line.confidence) / 2.0))
    grid = origin + np.concatenate([[0.0], np.geomspace(1e-4, 1.0, 400)]) * (horizon - origin)

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
            else float(scipy.optimize.brentq(lambda t: float(gap(t)), grid[i - 1], grid[i]))
        )

    at = first(0.0)
    return Crossing(limit, None if np.isinf(at) else at, (first(1.0), first(-1.0)))


def _probability(line: Trend, times: npt.ArrayLike, lower: float, upper: float) -> Array:
    value, _, u = predict(line, times)
    scale = np.maximum(u, 1e-300)
    below = scipy.special.stdtr(line.dof, (upper - value) / scale)
    return np.asarray(below - scipy.special.stdtr(line.dof, (lower - value) / scale))


def forecast(
    line: Trend,
    limits: tuple[float, float],
    origin: float,
    checks: npt.ArrayLike,
    *,
    reliability: float = 0.95,
    horizon: float | None = None,
) -> Forecast:
    """Forecast a drift ``line`` against ``limits`` (lower, upper) in the unit of its values.

    ``origin`` (now), ``checks`` (c,) and ``horizon`` in the unit of its times; without a horizon ten times the span of
    the history (from its mean time to now, doubled). An open side is an infinite limit. With what runs have
    in ``common`` in the line (the scale of the laser that measured them) the forecast is of the quantity, without it of
    what the same instrument will read. It counts as what few degrees of freedom leave of the line does, which is wider
    than it need be. Raises ``DataError`` for limits that do not rise, a check before now.
    Neglected: changes yet to come; see ``backtest``.
    """
    lower, upper = (float(x) for x in limits)
    if not lower < upper:
        raise DataError(f"limits is ({lower}, {upper}); the lower must be below the upper.")
    if not (np.isfinite(origin) and origin >= line.at):
        raise DataError(f"now is {origin}; it must not lie before the mean time of the history, {line.at}.")
    at = as_vector(checks, "checks", least=0)
    if at.size and at.min() < origin:
        raise DataError(f"checks holds {at.min()}; a planned check cannot lie before now, {origin}.")
    as_probability(reliability, "reliability")
    end = origin + 20.0 * max(origin - line.at, 1e-9) if horizon is None else float(horizon)
    if not end > origin:
        raise DataError(f"horizon is {end}; it must lie after now, {origin}.")
    sides = [
        _crossing(line, limit, side, origin, end)
        for limit, side in ((lower, -1.0), (upper, 1.0))
        if np.isfinite(limit)
    ]
    sides.sort(key=lambda c: (np.inf if c.at is None else c.at, c.interval[0]))
    grid = origin + np.concatenate([[0.0], np.geomspace(1e-4, 1.0, 2000)]) * (end - origin)
    out = np.flatnonzero(_probability(line, grid, lower, upper) < reliability)
    value = predict(line, at)[0]
    return Forecast(
        origin=origin,
        crossing=sides[0] if sides else Crossing(np.inf, None, (np.inf, np.inf)),
        checks=at,
        predicted=value,
        probability=_probability(line, at, lower, upper),
        recommended_interval=np.inf if not out.size else float(grid[max(int(out[0]) - 1, 0)] - origin),
        reliability=reliability,
        horizon=end,
        method=METHOD,
    )
