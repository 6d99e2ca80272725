"""Are the means of the groups equal? One-way ANOVA, Welch's ANOVA, Kruskal-Wallis; all columns at once.

ANOVA is the sharpest when the groups scatter alike; Welch's and Brown and Forsythe's do not ask for that (but need two
runs in a group); Kruskal-Wallis asks for no normal distribution, and loses little. Of many groups of two to four runs
Welch's alone raises false alarms (of ten days of three runs in 14 % instead of 5 %), of one group that scatters four
times as much Brown and Forsythe's (in up to 8 %, and at 0.5 % in 2 %), never both at once: where a call must hold its
rate whatever the scatter, take ``robust_p_value``, the larger of the two (docs/trials-statistics.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.statistics.checks import as_matrix
from monitor.statistics.sums import GroupedSums, grouped_sums, label_groups
from monitor.statistics.tails import chi_square_tail, f_tail, mean_ranks


@dataclass(frozen=True)
class GroupTest:
    """A test of k groups for p columns: ``statistic``, ``dof_denominator`` and ``p_value`` are (p,).

    ``dof_denominator`` is infinite for a chi-square statistic. NaN marks a column that says nothing
    because it never varies within nor between the groups.
    """

    name: str
    labels: tuple[str, ...]
    statistic: Array
    dof: int
    dof_denominator: Array
    p_value: Array


@dataclass(frozen=True)
class AnalysisOfVariance(GroupTest):
    """One-way ANOVA with its table; sums and mean squares (p,) in the squared unit of the values."""

    ss_between: Array
    ss_within: Array
    ms_between: Array
    ms_within: Array

    @property
    def residual_sd(self) -> Array:
        """Standard deviation within the groups (p,)."""
        return np.sqrt(self.ms_within)


def divide(numerator: Array, denominator: Array) -> Array:
    """Quotient with infinity for x/0 and NaN for 0/0, silently: both have a meaning here."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(numerator / denominator)


def anova_from_sums(sums: GroupedSums) -> AnalysisOfVariance:
    """One-way ANOVA of sums that were made before."""
    f = divide(sums.ms_between, sums.ms_within)
    dof2 = np.full_like(f, sums.dof_within)
    return AnalysisOfVariance(
        name="one-way ANOVA",
        labels=sums.labels,
        statistic=f,
        dof=sums.dof_between,
        dof_denominator=dof2,
        p_value=f_tail(f, sums.dof_between, dof2),
        ss_between=sums.ss_between,
        ss_within=sums.ss_within,
        ms_between=sums.ms_between,
        ms_within=sums.ms_within,
    )


def welch_from_sums(sums: GroupedSums) -> GroupTest:
    """Welch's ANOVA of sums that were made before (two runs in each group)."""
    counts = sums.counts[:, np.newaxis].astype(np.float64)
    k = sums.k
    # A group that never varies has an infinite weight; the test then says nothing (NaN).
    weight = divide(counts * (counts - 1.0), sums.ss_by_group)
    total = weight.sum(axis=0)
    with np.errstate(invalid="ignore"):
        centre = (weight * sums.mean_by_group).sum(axis=0) / total
        spread = ((1.0 - weight / total) ** 2 / (counts - 1.0)).sum(axis=0)
        numerator = (weight * (sums.mean_by_group - centre) ** 2).sum(axis=0) / (k - 1)
        f = numerator / (1.0 + 2.0 * (k - 2) / (k**2 - 1) * spread)
        dof2 = divide(np.full_like(spread, k**2 - 1.0), 3.0 * spread)
    return GroupTest("Welch ANOVA", sums.labels, f, k - 1, dof2, f_tail(f, k - 1, dof2))


@dataclass(frozen=True)
class VarianceMoments:
    """Sums over k groups of two runs and more for p columns: what Brown and Forsythe's test needs; all broadcast.

    ``groups`` and ``runs`` count them, ``between`` is the sum of squares between. Of the variances s² of groups of n
    runs: ``first`` = sum s², ``first_runs`` = sum n s², ``second`` = sum s⁴, ``second_runs`` = sum n s⁴, and
    ``by_dof`` =
    sum (1, n, n²) s⁴ / (n - 1).
    """

    groups: Array
    runs: Array
    between: Array
    first: Array
    first_runs: Array
    second: Array
    second_runs: Array
    by_dof: tuple[Array, Array, Array]


def brown_forsythe_from_moments(moments: VarianceMoments) -> tuple[Array, Array, Array, Array]:
    """F* of Brown and Forsythe, its two degrees of freedom and p-value; NaN for fewer than two groups.

    Source: M. B. Brown and A. B. Forsythe, Technometrics 16 (1974) 129; the degrees of freedom of the numerator by
    D. V. Mehrotra, Commun. Stat. Simul. Comput. 26 (1997) 1139.
    """
    n = moments.runs
    share, level = divide(moments.first_runs, n), moments.first
    expected = level - share
    with np.errstate(invalid="ignore"):
        between = moments.second + share**2 - 2.0 * divide(moments.second_runs, n)
        plain, once, twice = moments.by_dof
        within = plain - 2.0 * divide(once, n) + divide(twice, n**2)
        enough = (moments.groups >= 2.0) & (expected > 0.0)
    dof1, dof2 = (np.where(enough, divide(expected**2, part), np.nan) for part in (between, within))
    f = np.where(enough, divide(moments.between, expected), np.nan)
    return f, dof1, dof2, f_tail(f, dof1, dof2)


def brown_forsythe_from_sums(sums: GroupedSums) -> GroupTest:
    """Brown and Forsythe's test of sums that were made before (two runs in each group)."""
    n = sums.counts[:, np.newaxis].astype(np.float64)
    s2 = sums.ss_by_group / (n - 1.0)
    s4 = s2 * s2
    moments = VarianceMoments(
        groups=np.array(float(sums.k)),
        runs=np.array(float(sums.n)),
        between=sums.ss_between,
        first=s2.sum(axis=0),
        first_runs=(n * s2).sum(axis=0),
        second=s4.sum(axis=0),
        second_runs=(n * s4).sum(axis=0),
        by_dof=((s4 / (n - 1.0)).sum(axis=0), (n * s4 / (n - 1.0)).sum(axis=0), (n * n * s4 / (n - 1.0)).sum(axis=0)),
    )  # fmt: skip
    f, _, dof2, p_value = brown_forsythe_from_moments(moments)
    return GroupTest("Brown-Forsythe F*", sums.labels, f, sums.k - 1, dof2, p_value)


def brown_forsythe(values: npt.ArrayLike, groups: npt.ArrayLike) -> GroupTest:
    """Brown and Forsythe's F* for equal means of ``values`` (n, p), any unit, by ``groups`` (n,) of whatever scatter.

    At least two runs in each group or ``DataError``. Not their test of equal variances (``levene``). Measured false
    alarms at 5 % with 3 to 20 groups of 2 to 12 runs: 0.5 to 4 % where all scatter alike, up to 8 % with one that
    scatters four times as much (docs/trials-statistics.md).
    """
    return brown_forsythe_from_sums(grouped_sums(values, groups, least_runs=2))


def robust_p_value(values: npt.ArrayLike, groups: npt.ArrayLike) -> Array:
    """Return p-values (p,) of equal means that hold their level whatever the scatter of the groups: of two tests the
    larger.

    Welch's and Brown and Forsythe's, of the groups with two runs or more; NaN where there are fewer than two. A group
    of two runs may happen to repeat too well: no such group may decide alone, so that the largest p-value without each
    of them counts; of two groups, one of two runs, Welch's F is judged with one degree of freedom. Measured false
    alarms at 5 %: 0.3 to 4 %, at 0.5 %: below 0.8 %, with 3 to 20 groups of 2 to 12 runs, one of which or all of
    which scatter differently, normal or with heavy tails (docs/trials-statistics.md).
    """
    matrix = as_matrix(values, "values")
    labels, index = label_groups(groups, len(matrix))
    runs = np.bincount(index, minlength=len(labels))
    repeated = runs > 1
    if repeated.sum() < 2:
        return np.full(matrix.shape[1], np.nan)
    result = _larger_p_value(matrix, index, repeated)
    pairs = np.flatnonzero(runs == 2)
    if len(pairs) and repeated.sum() == 2:
        rows = repeated[index]
        welch = welch_from_sums(grouped_sums(matrix[rows], index[rows])).statistic
        return np.asarray(np.fmax(result, f_tail(welch, 1.0, 1.0)))
    for pair in pairs:
        without = repeated.copy()
        without[pair] = False
        result = np.fmax(result, _larger_p_value(matrix, index, without))
    return result


def _larger_p_value(matrix: Array, index: npt.NDArray[np.intp], included: npt.NDArray[np.bool_]) -> Array:
    """The larger p-value (p,) of the two tests of the groups (k,) that are included."""
    rows = included[index]
    sums = grouped_sums(matrix[rows], index[rows])
    return np.asarray(np.fmax(welch_from_sums(sums).p_value, brown_forsythe_from_sums(sums).p_value))


def anova(values: npt.ArrayLike, groups: npt.ArrayLike) -> AnalysisOfVariance:
    """One-way analysis of variance of ``values`` (n, p), any unit, by ``groups`` (n,).

    Assumes equal variances and normal scatter within the groups. Raises ``DataError`` (see
    ``grouped_sums``). Reaches 9 digits on NIST StRD SmLs01-06 and on SmLs07-09 what doubles of 13 constant
    leading digits still hold (tests/statistics/test_means.py).
    """
    return anova_from_sums(grouped_sums(values, groups))


def welch_anova(values: npt.ArrayLike, groups: npt.ArrayLike) -> GroupTest:
    """Welch's one-way ANOVA: means compared without assuming equal variances.

    ``values`` (n, p), ``groups`` (n,), at least two runs in each group or ``DataError``. Source: B. L.
    Welch, On the comparison of several mean values, Biometrika 38 (1951) 330, Eqs. (15) to (17). With
    small groups it is a little liberal: with five groups of four runs 5.7 % alarms at the nominal 5 % with
    equal scatter, 7.2 % with standard deviations of 1 to 5 (where ANOVA has 8.1 %).
    """
    return welch_from_sums(grouped_sums(values, groups, least_runs=2))


def kruskal_wallis(values: npt.ArrayLike, groups: npt.ArrayLike) -> GroupTest:
    """Kruskal-Wallis test on ranks, corrected for ties; chi-square approximation with k - 1 degrees.

    ``values`` (n, p), ``groups`` (n,). Raises ``DataError`` as ``grouped_sums`` does. Source: Kruskal and
    Wallis, JASA 47 (1952) 583. The approximation is conservative for small
    groups: 3.1 % alarms at the nominal 5 % with five groups of four runs.
    """
    sums = grouped_sums(values, groups)
    ranks = mean_ranks(sums.centred)
    n = sums.n
    offset = np.vstack([ranks[sums.index == j].mean(axis=0) for j in range(sums.k)]) - (n + 1) / 2.0
    between = (sums.counts[:, np.newaxis] * offset * offset).sum(axis=0)
    # The variance of the ranks themselves carries the correction for ties.
    h = divide(between, ranks.var(axis=0, ddof=1))
    dof = sums.k - 1
    p_value = chi_square_tail(h, dof)
    return GroupTest("Kruskal-Wallis", sums.labels, h, dof, np.full_like(h, np.inf), p_value)
