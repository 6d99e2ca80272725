"""Is there a step or a trend in the means of a few days? Whatever makes days differ, its rate holds.

A part of the search for changes (``changes``) for histories of a few days whose runs say nothing of how days differ:
there a step between two days has to stand out from the means of the days themselves. The statistic is the largest share
of their sum of squares that one step, at any place, or a straight line takes; it does not depend on their scatter.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from monitor.records import Array


def _share(means: Array) -> Array:
    """Largest share of the sum of squares of columns (d, m) that a step or a line takes (m,)."""
    d = len(means)
    columns = np.column_stack([np.arange(d), *(np.arange(d) >= first for first in range(1, d))]).astype(
        np.float64
    )
    columns -= columns.mean(axis=0)
    columns /= np.sqrt((columns**2).sum(axis=0))
    away = means - means.mean(axis=0)
    total = (away**2).sum(axis=0)
    largest = ((columns.T @ away) ** 2).max(axis=0)
    return np.asarray(largest / np.where(total > 0.0, total, 1.0))


@lru_cache(maxsize=32)
def _null(days: int, trials: int, seed: int) -> Array:
    return np.sort(_share(np.random.default_rng([seed, days]).standard_normal((days, trials))))


def day_step_p_value(y: Array, day: npt.NDArray[np.intp], rng: np.random.Generator, trials: int) -> float:
    """Return the p-value of the best step or line in the means of the days of ``y`` (n,), ``day`` (n,) from 0.

    Simulated with independent normal days, all with one scatter. Three days reach 1 % next to never, two never.
    """
    count = np.bincount(day)
    if len(count) < 3:
        return 1.0
    share = float(_share((np.bincount(day, y - y[0]) / count)[:, np.newaxis])[0])
    null = _null(len(count), trials, int(rng.integers(2**31)))
    return float(1 + len(null) - np.searchsorted(null, share)) / (len(null) + 1)
