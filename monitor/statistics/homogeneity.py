"""Are the groups (days) of a campaign alike, quantity by quantity? Every test at once, for all columns.

Equal variances: Bartlett and Brown-Forsythe. Equal means: one-way ANOVA, Welch's ANOVA, Brown and Forsythe's F*,
Kruskal-Wallis. What is called over all columns rests on the tests that hold their rate whatever the scatter.
The histogram of p-values over all probed coordinates is flat where the days are alike and piles up at zero
where they are not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_names
from monitor.statistics.fdr import FalseDiscoveries, control_false_discoveries
from monitor.statistics.means import (
    AnalysisOfVariance,
    GroupTest,
    anova_from_sums,
    brown_forsythe_from_sums,
    kruskal_wallis,
    robust_p_value,
    welch_from_sums,
)
from monitor.statistics.sums import grouped_sums
from monitor.statistics.variances import bartlett_from_sums, levene


@dataclass(frozen=True)
class Homogeneity:
    """Six tests of each of p columns; ``bartlett``, ``levene``, ``welch`` and ``brown_forsythe`` (of means) need two
    runs
    in each group and are None where a group has one. ``mean_discoveries`` holds the q-values of equal means over the
    columns, from ``robust_p_value``."""

    names: tuple[str, ...]
    labels: tuple[str, ...]
    counts: npt.NDArray[np.int64]
    anova: AnalysisOfVariance
    kruskal: GroupTest
    bartlett: GroupTest | None
    levene: GroupTest | None
    welch: GroupTest | None
    brown_forsythe: GroupTest | None
    mean_discoveries: FalseDiscoveries
    bartlett_discoveries: FalseDiscoveries | None


@dataclass(frozen=True)
class Histogram:
    """``counts`` (bins,) of p-values between ``edges`` (bins + 1,); ``expected`` in each bin if all null."""

    edges: Array
    counts: npt.NDArray[np.int64]
    expected: float


def homogeneity(
    values: npt.ArrayLike, groups: npt.ArrayLike, names: Sequence[str] | None = None, *, rate: float = 0.05
) -> Homogeneity:
    """All tests of equal variances and equal means of ``values`` (n, p), any unit, by ``groups`` (n,).

    ``rate`` is the false discovery rate over the p columns (Benjamini-Hochberg). Raises ``DataError`` for
    fewer than two groups, nothing repeated within a group, non-finite values or wrong shapes.
    """
    sums = grouped_sums(values, groups)
    columns = as_names(names, sums.centred.shape[1])
    analysis = anova_from_sums(sums)
    repeated = bool((sums.counts > 1).all())
    of_variances = bartlett_from_sums(sums) if repeated else None
    return Homogeneity(
        names=columns,
        labels=sums.labels,
        counts=sums.counts,
        anova=analysis,
        kruskal=kruskal_wallis(values, groups),
        bartlett=of_variances,
        levene=levene(values, groups) if repeated else None,
        welch=welch_from_sums(sums) if repeated else None,
        brown_forsythe=brown_forsythe_from_sums(sums) if repeated else None,
        mean_discoveries=control_false_discoveries(robust_p_value(values, groups), rate=rate),
        bartlett_discoveries=control_false_discoveries(of_variances.p_value, rate=rate)
        if of_variances
        else None,
    )


def p_value_histogram(p_values: npt.ArrayLike, *, bins: int = 20) -> Histogram:
    """Histogram of p-values over all coordinates, from 0 to 1; NaN (tests that say nothing) are left out."""
    if bins < 1:
        raise DataError(f"bins is {bins}; at least 1 is needed.")
    p = np.asarray(p_values, dtype=np.float64)
    p = p[~np.isnan(p)]
    counts, edges = np.histogram(p, bins=bins, range=(0.0, 1.0))
    if counts.sum() != p.size:
        raise DataError("p_values holds numbers outside 0 to 1; a histogram of probabilities is asked for.")
    return Histogram(edges, counts.astype(np.int64), p.size / bins)
