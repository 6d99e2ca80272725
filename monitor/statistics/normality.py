"""Is the scatter normal? Shapiro-Francia on what is left when the group means are taken out.

The statistic is the squared correlation of the ordered residuals with the normal quantiles. Residuals of
group means are dependent, which the published tables do not allow for, so the null distribution is simulated
with the same groups: the level is exact for any plan, three runs a day included.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.sums import grouped_sums


@dataclass(frozen=True)
class Normality:
    """``statistic`` (p,), 1 for a perfect line; ``p_value`` (p,) from ``trials`` simulated columns."""

    statistic: Array
    p_value: Array
    trials: int


def _shapiro_francia(residual: Array) -> Array:
    """Squared correlation of each sorted column with Blom's approximate normal order statistics."""
    n = len(residual)
    scores = scipy.special.ndtri((np.arange(1, n + 1) - 0.375) / (n + 0.25))
    ordered = np.sort(residual, axis=0)
    ordered -= ordered.mean(axis=0)
    total = (ordered * ordered).sum(axis=0)
    result = np.full(residual.shape[1], np.nan)
    np.divide((scores @ ordered) ** 2, total * (scores @ scores), out=result, where=total > 0.0)
    return result


def normality(
    values: npt.ArrayLike,
    groups: npt.ArrayLike | None = None,
    *,
    rng: np.random.Generator,
    trials: int = 20_000,
) -> Normality:
    """Test of normal scatter of ``values`` (n, p) within ``groups`` (n,); None means one group.

    The smallest p-value is 1 / (trials + 1). NaN for a column that never varies. Raises ``DataError`` for
    fewer than two degrees of freedom within the groups, fewer than 99 trials, non-finite values or wrong
    shapes. Source: Shapiro and Francia, JASA 67 (1972) 215; scores of Blom (1958).
    """
    if trials < 99:
        raise DataError(f"trials is {trials}; at least 99 are needed for a p-value of 0.01.")
    n = len(np.asarray(values))
    sums = grouped_sums(values, np.zeros(n, dtype=int) if groups is None else groups, least_groups=1)
    if sums.dof_within < 2:
        raise DataError(
            f"{n} runs in {sums.k} groups leave {sums.dof_within} degree(s) of freedom; 2 are needed."
        )
    statistic = _shapiro_francia(sums.residual)
    null = np.sort(_shapiro_francia(_null_residuals(sums.index, sums.counts, rng, trials)))
    below = np.searchsorted(null, statistic, side="right")
    p_value = np.where(np.isnan(statistic), np.nan, (below + 1.0) / (trials + 1.0))
    return Normality(statistic, p_value, trials)


def _null_residuals(
    index: npt.NDArray[np.intp], counts: npt.NDArray[np.int64], rng: np.random.Generator, trials: int
) -> Array:
    """Standard normal columns (n, trials) less their group means."""
    draws = rng.standard_normal((len(index), trials))
    for j in range(len(counts)):
        rows = index == j
        draws[rows] -= draws[rows].mean(axis=0)
    return draws
