"""A target whose readings scatter more than those of the others: a ball that shakes in its seat, a setup that is loose.

Its touches deviate from the same touches of the other runs, one by one, so that each looks like a bad point. It is one
suspect: its readings count by so much less, and what is sought is judged beside it. Only what runs do not share is
looked at, so that an error that the model lacks makes no target scatter.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.noise.plan_cells import plan_cells
from monitor.discovery.machine.suspects.anomalies import checked_parts, statistic
from monitor.records import Array

# Below this ratio of standard deviations it does little harm; arms and heights of balls in errors of the machine that
# vary from run to run differ by about as much.
LEAST_TIMES = 2.0
# Of all targets together, by ranks, so that tails do not matter.
FALSE_ALARM = 1e-4
# Two targets say that one scatters more, not which of them is as it should be.
FEWEST_TARGETS = 3
FEWEST_TOUCHES = 8
# Runs that repeat one another to less than a thousandth of what is stated are copies, or simulated without noise:
# beside them nothing is seen to scatter more.
LEAST_OF_STATED = 1e-6
# A wreck among the touches of a target is no scatter: a touch counts at most as one of this probability.
TAIL = 1e-4


@dataclass(frozen=True)
class Scatter:
    """A target whose readings have ``times`` the standard deviation of those of the others, ``deviation`` mm, by
    ``touches`` that several runs repeat; ``gain`` is what that explains, as twice a logarithm of a likelihood ratio."""

    target: str
    times: float
    deviation: float
    touches: int
    p_value: float
    gain: float


@dataclass(frozen=True)
class _Squares:
    """Of touches that runs repeat: target, chi-square of the deviation from the other runs, and its rank, all (m,)."""

    target: npt.NDArray[np.str_]
    square: Array
    rank: npt.NDArray[np.int64]

    @property
    def typical(self) -> Array:
        """The squares (m,) as multiples of their median under noise as stated."""
        return np.asarray(self.square / scipy.special.chdtri(self.rank, 0.5))


def _squares(fit: Fit) -> _Squares:
    problem, context = fit.problem, fit.problem.context
    judged = ~fit.left_out & ~np.isin(context.target, list(problem.resting))
    white = np.where(judged[:, None], fit.vectors / problem.sigma, 0.0)
    cells = plan_cells(problem)
    count = np.bincount(cells, weights=judged)[cells]
    mean = np.stack([np.bincount(cells, weights=column)[cells] for column in white.T], axis=1)
    deviation = white - mean / np.maximum(count, 1.0)[:, None]
    # Of two runs the deviations are the same vector twice.
    first = np.zeros(len(cells), dtype=bool)
    first[np.unique(np.where(judged, cells, cells.max() + 1), return_index=True)[1]] = True
    repeated = judged & ((count > 2) | ((count == 2) & first))
    square, rank, _ = statistic(deviation, checked_parts(fit))
    tested = repeated & (rank > 0)
    inflation = 1.0 - 1.0 / count[tested]
    return _Squares(context.target[tested], square[tested] / inflation, rank[tested])


def _variance_beside_others(squares: _Squares, target: str, *, stated_alike: bool) -> float:
    """The variance of a target's readings over that of the others; over what is stated, where instruments that are
    stated differently scatter less than that."""
    of_target = squares.target == target
    typical = squares.typical
    reference = float(np.median(typical[~of_target]))
    return float(np.median(typical[of_target])) / (reference if stated_alike else max(reference, 1.0))


def _is_stated_alike(fit: Fit) -> bool:
    sigma = fit.problem.sigma[np.isfinite(fit.problem.sigma)]
    return bool(np.ptp(sigma) <= 1e-9 * sigma.max(initial=1.0))


def scattering(fit: Fit, named: Collection[str] = ()) -> Scatter | None:
    """The target that scatters most beyond the others, besides those ``named``; None where none does, or so many do
    that the others are few."""
    squares = _squares(fit)
    names, touches = np.unique(squares.target, return_counts=True)
    judged = [str(name) for name, number in zip(names, touches, strict=True) if number >= FEWEST_TOUCHES]
    if len(judged) < FEWEST_TARGETS or 2 * (len(named) + 1) >= len(judged):
        return None
    alike = not named and _is_stated_alike(fit)
    scatters = [
        scatter
        for name in judged
        if name not in named and (scatter := _scatter(fit, squares, name, len(judged), alike)) is not None
    ]
    return max(scatters, key=lambda scatter: scatter.gain, default=None)


def _scatter(fit: Fit, squares: _Squares, target: str, tests: int, alike: bool) -> Scatter | None:
    of_target = squares.target == target
    typical = squares.typical
    if float(np.median(typical[~of_target])) < LEAST_OF_STATED:
        return None
    variance = _variance_beside_others(squares, target, stated_alike=alike)
    if variance < LEAST_TIMES**2:
        return None
    ranked = scipy.stats.mannwhitneyu(
        typical[of_target], typical[~of_target], alternative="greater", method="asymptotic"
    )
    p_value = float(ranked.pvalue) * tests
    if p_value > FALSE_ALARM:
        return None
    square, rank = squares.square[of_target] / float(np.median(typical[~of_target])), squares.rank[of_target]
    square = np.minimum(square, variance * scipy.special.chdtri(rank, TAIL))
    price = np.log(len(typical))
    gain = float(np.sum(square * (1.0 - 1.0 / variance) - rank * np.log(variance))) - float(price)
    sigma = fit.problem.sigma[fit.problem.context.target == target]
    stated = float(np.sqrt(np.mean(sigma[np.isfinite(sigma)] ** 2)))
    deviation = stated * float(np.sqrt(np.median(typical[of_target])))
    return Scatter(target, float(np.sqrt(variance)), deviation, int(of_target.sum()), min(1.0, p_value), gain)


def settled(fit: Fit, scatter: Scatter) -> Scatter:
    """The scatter of a target once its readings count by so much less, so that they no longer move the others;
    ``fit`` weighs them by ``scatter``."""
    squares = _squares(fit)
    variance = _variance_beside_others(squares, scatter.target, stated_alike=True)
    of_target = squares.typical[squares.target == scatter.target]
    sigma = fit.problem.sigma[fit.problem.context.target == scatter.target]
    weighed = float(np.sqrt(np.mean(sigma[np.isfinite(sigma)] ** 2)))
    return Scatter(
        scatter.target,
        scatter.times * float(np.sqrt(variance)),
        weighed * float(np.sqrt(np.median(of_target))),
        scatter.touches,
        scatter.p_value,
        scatter.gain,
    )
