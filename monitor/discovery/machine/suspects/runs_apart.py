"""A run that is unlike the others: its touches scatter more, or something drifted while it was measured.

A draught, a door that stood open, a clamp that gave way in one run is no effect that all runs share, no ball that
moved and no point; it was left as "no effect explains more". Touches of the runs are compared by ranks, so that tails
do not matter; neighbours that resemble each other count as fewer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.suspects.anomalies import checked_parts, statistic
from monitor.discovery.search.projection import orthonormal
from monitor.records import Array
from monitor.statistics.tails import mean_ranks

# Runs of a real machine differ by a third; what is less has not spoilt anything.
LEAST_TIMES = 1.35
FALSE_ALARM = 1e-5
# Of two runs one is unlike the other, and nobody knows which.
FEWEST_RUNS = 3
# Neighbours within so many touches may resemble each other.
LAGS = 12
# A drift is named where it makes up half of what the run has beyond the others, beyond any doubt.
HALF, LEVEL = 0.5, 1e-6


@dataclass(frozen=True)
class RunApart:
    """A ``run`` that leaves ``times`` what the others leave, ``deviation`` mm in a reading; ``neighbours`` is the
    correlation of one touch with the next in it. ``as_if`` is the effect that, drifting through it, makes up most of
    that; None where none does."""

    run: int
    times: float
    deviation: float
    neighbours: float
    p_value: float
    as_if: str | None = None


def runs_apart(scene: ChainScene) -> tuple[RunApart, ...]:
    """The runs that leave more than the others under the fit of a scene, of which the candidates that follow the time
    of the run are asked, under its noise of neighbours; none where they are most of the runs."""
    fit = scene.fit
    runs = fit.problem.runs
    if len(runs) < FEWEST_RUNS:
        return ()
    typical, judged = _typical(fit)
    apart = [
        unlike
        for number in range(len(runs))
        if (unlike := _apart(scene, typical, judged, number)) is not None
    ]
    return tuple(apart) if 2 * len(apart) < len(runs) else ()


def _typical(fit: Fit) -> tuple[Array, npt.NDArray[np.bool_]]:
    """The squares (n,) of touches as multiples of their median under noise as stated, and which of them count (n,)."""
    white = np.where(fit.left_out[:, None], 0.0, fit.vectors / fit.problem.sigma)
    square, rank, _ = statistic(white, checked_parts(fit))
    judged = ~fit.left_out & (rank > 0)
    return square / scipy.special.chdtri(np.maximum(rank, 1), 0.5), judged


def _apart(scene: ChainScene, typical: Array, judged: npt.NDArray[np.bool_], number: int) -> RunApart | None:
    fit = scene.fit
    run = fit.problem.runs[number]
    inside = fit.problem.context.run == run
    mine, others = typical[judged & inside], typical[judged & ~inside]
    if len(mine) < LAGS or float(np.median(others)) <= 0.0:
        return None
    times = float(np.sqrt(np.median(mine) / np.median(others)))
    # Medians of a slow wave say little: its mean does.
    times = max(times, float(np.sqrt(np.mean(mine) / np.mean(others))))
    p_value = _p_value(mine, others) * len(fit.problem.runs)
    if times < LEAST_TIMES or p_value > FALSE_ALARM:
        return None
    sigma = fit.problem.sigma[inside]
    stated = float(np.sqrt(np.mean(sigma[np.isfinite(sigma)] ** 2)))
    return RunApart(
        int(run),
        times,
        stated * float(np.sqrt(np.median(others))) * times,
        _neighbours(fit.vectors[judged & inside]),
        min(1.0, p_value),
        _as_if(scene, number, times),
    )


def _p_value(mine: Array, others: Array) -> float:
    """The probability by ranks that the touches of a run are so much larger by chance."""
    ranks = mean_ranks(np.concatenate([mine, others])[:, None])[:, 0]
    of_run = ranks[: len(mine)]
    correlations = _correlations(of_run - of_run.mean())
    # Beyond the first touch that no longer goes along they are noise.
    share = 1.0 + 2.0 * float(correlations[: int(np.argmin([*(correlations > 0.0), False]))].sum())
    excess = float(np.sum(of_run) - len(mine) * (len(ranks) + 1) / 2.0)
    spread = np.sqrt(len(mine) * len(others) * (len(ranks) + 1) / 12.0 * share)
    return float(scipy.special.ndtr(-excess / spread))


def _correlations(values: Array) -> Array:
    """The correlations of a series (n,) of mean zero with itself, so many touches later."""
    total = max(float(values @ values), 1e-300)
    return np.array([float(values[lag:] @ values[:-lag]) / total for lag in range(1, LAGS)])


def _neighbours(vectors: Array) -> float:
    """The correlation of residuals (n, d) of a run with those of the next touch."""
    read = np.where(np.isfinite(vectors), vectors, 0.0)
    return float(np.sum(read[1:] * read[:-1]) / max(np.sum(read**2), 1e-300))


def _as_if(scene: ChainScene, number: int, times: float) -> str | None:
    """The effect that, drifting through one run alone, takes most of what it has beyond the others."""
    inside = scene.run == number
    residual = np.where(inside, scene.residual, 0.0)
    total = float(residual @ residual)
    best, most = None, HALF * total * (1.0 - 1.0 / times**2)
    drifting = [candidate for candidate in scene.candidates if _drifts(candidate)]
    freedom, tests = int(inside.sum()) - 1, len(drifting) * len(scene.fit.problem.runs)
    for candidate in drifting:
        columns = orthonormal(np.where(inside[:, None], candidate.columns, 0.0))
        explained, size = float(np.sum((columns.T @ residual) ** 2)), columns.shape[1]
        if not size or explained <= most:
            continue
        ratio = explained / size / max((total - explained) / max(freedom - size, 1), 1e-300)
        if scipy.special.fdtrc(size, freedom - size, ratio) * tests < LEVEL:
            best, most = candidate.family.partition("@")[0], explained
    return best


def _drifts(candidate: ChainCandidate) -> bool:
    return candidate.visible and candidate.family.endswith("@run_time")
