"""Do the groups scatter alike? Bartlett and Levene / Brown-Forsythe, for all columns at once.

Bartlett is the sharpest for normal scatter and takes long tails for unequal variances; Brown-Forsythe
(Levene about the median) does not, and is the one to believe where the two disagree.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.means import GroupTest, anova, divide
from monitor.statistics.sums import GroupedSums, grouped_sums
from monitor.statistics.tails import chi_square_tail


def bartlett_from_sums(sums: GroupedSums) -> GroupTest:
    """Bartlett's test of sums that were made before (two runs in each group)."""
    dof = sums.counts[:, np.newaxis] - 1.0
    within = sums.dof_within
    with np.errstate(divide="ignore", invalid="ignore"):
        # Logarithms of ratios: a column of nanometres and one of metres lose the same (no) digits.
        numerator = -(dof * np.log(sums.ss_by_group / dof / sums.ms_within)).sum(axis=0)
    correction = 1.0 + ((1.0 / dof).sum() - 1.0 / within) / (3.0 * (sums.k - 1))
    statistic = np.maximum(numerator / correction, 0.0)
    p_value = chi_square_tail(statistic, sums.k - 1)
    return GroupTest("Bartlett", sums.labels, statistic, sums.k - 1, np.full_like(statistic, np.inf), p_value)


def bartlett(values: npt.ArrayLike, groups: npt.ArrayLike) -> GroupTest:
    """Bartlett's test of equal variances of ``values`` (n, p), any unit, by ``groups`` (n,).

    Chi-square with k - 1 degrees of freedom. Raises ``DataError`` for a group of one run or non-finite
    values; a group that never varies beside one that does gives an infinite statistic and p = 0. Source:
    NIST/SEMATECH e-Handbook 1.3.5.7.
    """
    return bartlett_from_sums(grouped_sums(values, groups, least_runs=2))


def levene(
    values: npt.ArrayLike, groups: npt.ArrayLike, *, centre: Literal["median", "mean"] = "median"
) -> GroupTest:
    """Levene's test about the group means, or about the medians (Brown-Forsythe, the default).

    ``values`` (n, p), ``groups`` (n,), two runs in each group or ``DataError``. F with k - 1 and n - k
    degrees of freedom. About the median with five groups of four runs it has 6.4 % alarms at the nominal
    5 %. Source: NIST/SEMATECH e-Handbook 1.3.5.10.
    """
    if centre not in ("median", "mean"):
        raise DataError(f"centre is {centre!r}; it is 'median' or 'mean'.")
    sums = grouped_sums(values, groups, least_runs=2)
    distance = np.empty_like(sums.residual)
    for j in range(sums.k):
        rows = sums.index == j
        block = sums.residual[rows]
        middle: Array = np.median(block, axis=0) if centre == "median" else np.zeros(block.shape[1])
        distance[rows] = np.abs(block - middle)
    result = anova(distance, sums.index)
    name = "Brown-Forsythe" if centre == "median" else "Levene"
    statistic = divide(result.ms_between, result.ms_within)
    return GroupTest(name, sums.labels, statistic, result.dof, result.dof_denominator, result.p_value)
