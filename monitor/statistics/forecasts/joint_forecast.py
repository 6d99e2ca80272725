"""Forecast of when the volumetric error leaves its limit: the longest of many vectors that follow all parameters.

Each parameter is extrapolated by its own line (``trend``), and the lines and the scatter about them are correlated as
the residuals of the days are. The longest vector is no linear function of the parameters: it is simulated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy
from numpy.polynomial import chebyshev

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_probability, as_vector
from monitor.statistics.forecasts.forecast import Crossing, predict
from monitor.statistics.forecasts.longest_vector import ErrorVectors
from monitor.statistics.trend import Trend

#: Simulated futures: the probability at a check is good to 0.011 (one standard deviation at 0.5).
DRAWS = 2000
#: Times searched between now and the horizon, denser near now; crossings are interpolated between them.
TIMES = 60
#: Fewest days without which the parameters count as uncorrelated.
FEWEST_DAYS = 4
#: Points at which chi-square is solved for; in between a polynomial has it to 1e-11 (measured, 1 to 1e6 degrees).
NODES = 48


@dataclass(frozen=True)
class JointLines:
    """The ``lines`` of p parameters, and the ``correlation`` (p, p) of lines and scatter.

    The lines are in the unit of their values over days or any unit of time. ``common`` (q, p, 2) is what their levels
    and slopes are off by for one standard uncertainty of each of q quantities that runs have in common; None without.
    """

    lines: Sequence[Trend]
    correlation: Array
    common: Array | None = None

    def predict(self, t: float) -> Array:
        """Return the best estimate (p,) of the parameters at a time."""
        return np.array([float(predict(line, t)[0]) for line in self.lines])

    @property
    def centre(self) -> Array:
        """Mean times (p,) of the lines."""
        return np.array([line.at for line in self.lines])


@dataclass(frozen=True)
class LengthQuestion:
    """A ``limit`` of the longest vector, the forecast ``origin`` (now), and the times ``checks`` (c,) of planned ones.

    ``horizon`` is the end of the search, ``reliability`` the wanted probability of a run in tolerance, ``level`` that
    of intervals. Raises DataError for a limit that is not above zero, a check before now, or a horizon not after it.
    """

    limit: float
    origin: float
    checks: npt.ArrayLike
    horizon: float
    reliability: float = 0.95
    level: float = 0.95

    def __post_init__(self) -> None:
        if not (np.isfinite(self.limit) and self.limit > 0.0):
            raise DataError(f"limit is {self.limit}; the longest vector needs a limit above zero.")
        checks = as_vector(self.checks, "checks", least=0)
        if checks.size and checks.min() < self.origin:
            raise DataError(
                f"checks holds {checks.min()}; a planned check cannot lie before now, {self.origin}."
            )
        if not self.horizon > self.origin:
            raise DataError(f"horizon is {self.horizon}; it must lie after now, {self.origin}.")
        as_probability(self.reliability, "reliability")
        as_probability(self.level, "level")


@dataclass(frozen=True)
class LengthForecast:
    """``crossing`` of the limit by the lines; ``probability`` (c,) that a run is in tolerance at ``checks`` (c,).

    ``predicted`` (c,) is the median of the longest vector of a run, ``interval`` (c, 2) holds it with ``level``;
    ``recommended_interval`` is the longest time from ``origin`` on with which a run stays in tolerance with
    ``reliability`` (infinite beyond ``horizon``). ``latest`` is the length at ``origin`` by the lines.
    """

    origin: float
    latest: float
    crossing: Crossing
    checks: Array
    predicted: Array
    interval: Array
    probability: Array
    recommended_interval: float
    reliability: float
    level: float
    horizon: float


def residual_correlation(
    residuals: npt.ArrayLike, days: npt.ArrayLike
) -> tuple[npt.NDArray[np.float64], float, int]:
    """Correlation (p, p) of the day means of ``residuals`` (n, p), shrunk towards none, the shrinkage and the days.

    Rows with a NaN are left out. With few days a correlation matrix is mostly noise: it is shrunk by the share that
    its own sampling variance has (Schäfer and Strimmer, Stat. Appl. Genet. Mol. Biol. 4 (2005) 32). Fewer than 4
    days: the unit matrix, shrinkage 1.
    """
    rows = np.asarray(residuals, dtype=np.float64)
    whole = np.isfinite(rows).all(axis=1)
    rows, labels = rows[whole], np.asarray(days)[whole]
    count = len(np.unique(labels))
    p = rows.shape[1]
    if count < FEWEST_DAYS:
        return np.eye(p), 1.0, count
    index = np.unique(labels, return_inverse=True)[1]
    means = np.zeros((count, p))
    np.add.at(means, index, rows)
    means /= np.bincount(index)[:, np.newaxis]
    means -= means.mean(axis=0)
    sd = means.std(axis=0, ddof=1)
    scaled = means / np.where(sd > 0.0, sd, np.inf)
    products = scaled[:, :, np.newaxis] * scaled[:, np.newaxis, :]
    r = products.sum(axis=0) / (count - 1)
    variance = count / (count - 1.0) ** 3 * ((products - products.mean(axis=0)) ** 2).sum(axis=0)
    off = ~np.eye(p, dtype=np.bool_)
    square = float((r[off] ** 2).sum())
    shrink = 1.0 if square == 0.0 else float(np.clip(variance[off].sum() / square, 0.0, 1.0))
    return np.where(off, (1.0 - shrink) * r, 1.0), shrink, count


def _chi_square(u: Array, dof: Array) -> Array:
    """Chi-square (m, p) that is exceeded with the probabilities ``u`` (m,), for p degrees of freedom of 1 and more.

    Its logarithm over the normal deviate of the same probability is so smooth that a polynomial through 48 Chebyshev
    points has it to 1e-11: a tenth of the time of solving for every one of thousands of draws.
    """
    z = scipy.special.ndtri(u)
    middle, half = 0.5 * (z.max() + z.min()), max(0.5 * float(np.ptp(z)), 1e-9)
    nodes = chebyshev.chebpts1(NODES)
    node_logarithms = np.log(
        scipy.special.chdtri(dof, scipy.special.ndtr(middle + half * nodes)[:, np.newaxis])
    )
    factors = np.linalg.solve(chebyshev.chebvander(nodes, NODES - 1), node_logarithms)
    return np.asarray(np.exp(chebyshev.chebvander((z - middle) / half, NODES - 1) @ factors))


@dataclass(frozen=True)
class Futures:
    """Simulated deviations (m, p) of p parameters from their best lines: of ``level``, ``slope`` and of a ``run``."""

    lines: JointLines
    level: Array
    slope: Array
    run: Array

    def parameters(self, t: float, *, of_runs: bool) -> Array:
        """Return the parameters (m, p) at a time, of the lines alone or of runs about them."""
        deviation = self.level + self.slope * (t - self.lines.centre)
        return self.lines.predict(t) + deviation + (self.run if of_runs else 0.0)


def draw_lines(joint: JointLines, rng: np.random.Generator, count: int) -> Futures:
    """Draw ``count`` futures of the lines and of a run about each; each a t of the line's degrees of freedom."""
    lines = joint.lines
    values, vectors = np.linalg.eigh(joint.correlation)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    z = rng.standard_normal((3, count, len(lines))) @ root.T
    u = rng.uniform(size=count)
    dof = np.array([line.dof for line in lines])
    heavy = np.sqrt(dof / _chi_square(u, dof))
    roots = np.array([np.linalg.cholesky(line.covariance + 1e-30 * np.eye(2)) for line in lines])
    level = z[0] * roots[:, 0, 0]
    slope = z[0] * roots[:, 1, 0] + z[1] * roots[:, 1, 1]
    level *= heavy
    slope *= heavy
    if joint.common is not None and joint.common.size:
        off_together = np.tensordot(rng.standard_normal((count, len(joint.common))), joint.common, axes=1)
        level += off_together[:, :, 0]
        slope += off_together[:, :, 1]
    return Futures(joint, level, slope, z[2] * np.array([line.run_sd for line in lines]) * heavy)


def _first_crossing(times: Array, lengths: Array, limit: float) -> Array:
    """First time at which each row (m, t) of lengths reaches the limit; infinite where none does."""
    beyond = lengths >= limit
    first = beyond.argmax(axis=1)
    rows = np.arange(len(lengths))
    before = np.maximum(first - 1, 0)
    low, high = lengths[rows, before], lengths[rows, first]
    share = (limit - low) / np.where(high > low, high - low, 1.0)
    at = times[before] + share * (times[first] - times[before])
    at = np.where(first == 0, times[0], at)
    return np.asarray(np.where(beyond.any(axis=1), at, np.inf))


def _followed(vectors: ErrorVectors, futures: Futures, times: Sequence[float]) -> ErrorVectors:
    """Return the vectors that are the longest of some future: only these need be followed."""
    worst: set[int] = set()
    for t in times:
        best = futures.lines.predict(t)
        deviation = futures.level + futures.slope * (t - futures.lines.centre) + futures.run
        rows = np.vstack([best + deviation[:100], best])
        at = np.tensordot(rows, vectors.sensitivity, axes=([1], [2])) + vectors.offset
        worst |= set((at**2).sum(axis=2).argmax(axis=1).tolist())
    return vectors.places(sorted(worst))


def forecast_longest(
    lines: JointLines,
    vectors: ErrorVectors,
    question: LengthQuestion,
    *,
    rng: np.random.Generator,
    draws: int = DRAWS,
) -> LengthForecast:
    """Forecast the longest of the error vectors against a limit.

    Neglected: changes yet to come, correlation of the days in time, and products of errors (1e-4 of a vector). A
    longest vector estimated with uncertainty is on average longer than the true one; so is that of every run that
    will be measured, which is what the probability is about.
    """
    limit, origin, horizon = question.limit, question.origin, question.horizon
    checks = as_vector(question.checks, "checks", least=0)
    tail = (1.0 - question.level) / 2.0
    futures = draw_lines(lines, rng, draws)
    times = origin + np.concatenate([[0.0], np.geomspace(1e-4, 1.0, TIMES)]) * (horizon - origin)
    followed = _followed(vectors, futures, [*times[:: TIMES // 6], *checks])
    of_lines = np.column_stack([followed.longest(futures.parameters(t, of_runs=False)) for t in times])
    certain = np.array([[followed.longest(lines.predict(t)[np.newaxis])[0] for t in times]])
    first = np.sort(_first_crossing(times, of_lines, limit))
    crossing = float(_first_crossing(times, certain, limit)[0])
    # Order statistics: an interpolated quantile of infinities is not a number.
    ends = (float(first[int(tail * draws)]), float(first[min(int(np.ceil((1.0 - tail) * draws)), draws) - 1]))
    inside = np.array(
        [float((followed.longest(futures.parameters(t, of_runs=True)) <= limit).mean()) for t in times]
    )
    out = np.flatnonzero(inside < question.reliability)
    lengths = [followed.longest(futures.parameters(t, of_runs=True)) for t in checks]
    return LengthForecast(
        origin=origin,
        latest=float(certain[0, 0]),
        crossing=Crossing(limit, None if np.isinf(crossing) else crossing, ends),
        checks=checks,
        predicted=np.array([float(np.median(length)) for length in lengths]),
        interval=np.array([np.quantile(length, [tail, 1.0 - tail]) for length in lengths]).reshape(-1, 2),
        probability=np.array([float((length <= limit).mean()) for length in lengths]),
        recommended_interval=np.inf if not out.size else float(times[max(int(out[0]) - 1, 0)] - origin),
        reliability=question.reliability,
        level=question.level,
        horizon=horizon,
    )
