"""Does the latest day stand out from the days before it? One day, after which none tells whether it stays.

A search for steps needs two days on either side (``scan_candidates.EDGE``): what happened before the latest day would
be found one day late. Here the latest mean is held against what the earlier ones foretell of it, by Student's t
distribution. Of independent days about one mean that is the comparison by which the table of all machines ranks
(``sufficient``). Days may also resemble each other, or drift: of a mean and a line, each with every correlation that
the earlier days do not refute, the one by which the latest day stands out least is believed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy

from monitor.records import Array

#: With fewer days, the latest among them, nothing is said.
FEWEST_DAYS = 6
#: Correlations of neighbouring days that are looked at; a search for changes allows for as much (``find_changes``).
_CORRELATIONS = (0.0, 0.2, 0.4, 0.6, 0.8)
#: A correlation is refuted where its log likelihood lies so far below the best: half the 95 % point of chi-squared.
_REFUTED = 1.92
#: What differs by less than this part of the value is rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class LatestDay:
    """By how much the latest day differs from what the days before it foretell, its standard uncertainty, and the
    probability of a difference as large where nothing happened, of normal days.

    ``times_others`` is how many times as far off as any day before it: where days have heavy tails, ``p_value`` alone
    says too much.
    """

    size: float
    u: float
    p_value: float
    times_others: float


def latest_day(t: Array, means: Array, more: float = 0.0) -> LatestDay | None:
    """Return what the last of the ``means`` (n,) of days at ``t`` (n,), rising, differs by; None of few days, or of
    days that do not scatter.

    ``more`` is the variance that the latest mean has beyond that of the others, of fewer runs or less sure ones.
    """
    days = len(means)
    if days < FEWEST_DAYS or np.ptp(means[:-1]) <= _ROUNDING * np.abs(means).max():
        return None
    time = (t - t.mean()) / np.ptp(t)
    every = [
        apart_by
        for base in (np.ones((days, 1)), np.column_stack([np.ones(days), time]))
        for apart_by in _by_correlations(np.diff(t), base, means, more)
    ]
    least = max(every, key=lambda apart_by: apart_by.p_value)
    return replace(least, times_others=min(apart_by.times_others for apart_by in every))


def _by_correlations(apart: Array, base: Array, means: Array, more: float) -> list[LatestDay]:
    """The latest day beside a ``base`` (n, k), with each correlation of the days before it that they do not refute."""
    steps = apart / np.median(apart)
    judged = [_beside(rho ** np.maximum(steps, 1e-3) if rho else np.zeros_like(steps), base, means, more)
              for rho in _CORRELATIONS]  # fmt: skip
    best = max(likelihood for likelihood, _ in judged)
    return [apart_by for likelihood, apart_by in judged if likelihood >= best - _REFUTED]


def _beside(
    following: npt.NDArray[np.float64], base: Array, means: Array, more: float
) -> tuple[float, LatestDay]:
    """The restricted log likelihood of the days before, of which each follows the last by ``following`` (n - 1,), and
    the latest day."""
    alone = np.sqrt(1.0 - following**2)
    rows = np.column_stack([base, means])
    white = rows.copy()
    white[1:] = (rows[1:] - following[:, np.newaxis] * rows[:-1]) / alone[:, np.newaxis]
    before, latest = white[:-1], white[-1]
    q, r = np.linalg.qr(before[:, :-1])
    y = before[:, -1]
    unexplained = y - q @ (q.T @ y)
    dof = len(y) - r.shape[1]
    variance = float(unexplained @ unexplained) / dof
    likelihood = -0.5 * dof * np.log(variance) - np.log(alone[:-1]).sum() - np.log(np.abs(np.diag(r))).sum()
    coefficients = np.linalg.solve(r, q.T @ y)
    reach = np.linalg.solve(r.T, latest[:-1])
    # In units of the scatter of a day about what the day before it foretells.
    off = float(latest[-1] - latest[:-1] @ coefficients)
    size = off * float(alone[-1])
    u = float(np.sqrt(variance * (1.0 + reach @ reach) * alone[-1] ** 2 + more))
    p_value = float(2.0 * scipy.special.stdtr(dof, -abs(size) / u))
    return float(likelihood), LatestDay(size, u, p_value, abs(off) / float(np.abs(unexplained).max()))
