"""Tests from sums alone: Bartlett, ANOVA and the drift of the groups for thousands of cells at once.

For fleets, whose values stay in the database. The same answers as ``homogeneity`` and ``trend`` give from the
values themselves; here each cell (a machine and parameter) has groups and runs of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from monitor.exceptions import DataError
from monitor.group_sums import GroupSums
from monitor.records import Array
from monitor.statistics.days.block_lines import DEPENDENT, BlockLines, Blocks, block_lines
from monitor.statistics.days.seasonal_slopes import beside_season
from monitor.statistics.tails import chi_square_tail, f_tail, student_tail


@dataclass(frozen=True)
class CellTests:
    """Results of c cells, NaN where the groups or runs do not suffice.

    ``mean`` is relative to the origin, in the unit of the values, as are ``sd_all`` and ``sd_pooled``; ``anova_f`` and
    ``bartlett`` (chi-square) have ``dof_between`` (for Bartlett: repeated groups less one) and ``dof_within``.
    ``between`` is the standard deviation of the groups beyond the scatter within (0 where none is seen).
    """

    mean: Array
    sd_all: Array
    sd_pooled: Array
    between: Array
    dof_between: Array
    dof_within: Array
    ss_between: Array
    anova_f: Array
    anova_p: Array
    bartlett: Array
    bartlett_p: Array


@dataclass(frozen=True)
class CellDrift:
    """Straight line of the group means over time, unweighted: ``slope`` per unit of t, ``u``, ``p_value`` (c,).

    ``widening`` (c,) is how much wider ``u`` is than with independent groups; NaN where they were taken as such.
    ``season_p`` is the p-value of a season being all of the slope, NaN where none is asked of it; ``steepness`` the
    slope over its uncertainty without a season. ``lines`` are those of the blocks that allow for the resemblance, None
    where the groups were taken as independent.
    """

    slope: Array
    u: Array
    p_value: Array
    widening: Array
    season_p: Array
    steepness: Array
    lines: BlockLines | None = None


def _quotient(numerator: Array, denominator: Array) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(numerator / denominator)


def _checked(values: Array, name: str, count: int) -> Array:
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (count,):
        raise DataError(f"{name} has shape {array.shape}; ({count},) is needed, a number for each cell.")
    return array


def cells_from_sums(sums: GroupSums) -> CellTests:
    """One-way ANOVA and Bartlett of every cell. Raises DataError for arrays of different length.

    The sum of squares between is ``squares - offset² / runs``: exact to rounding as long as the origin lies as near
    to the mean as the groups lie to each other; from further away it loses 2 lg(distance / scatter) of 16 digits.
    Source: M. S. Bartlett, Proc. R. Soc. A 160 (1937) 268, as in the e-Handbook 1.3.5.7.
    """
    count = len(np.asarray(sums.runs))
    k, n, offset, squares, within, repeated, least, logs, inverse = (
        _checked(getattr(sums, field.name), field.name, count) for field in fields(GroupSums)
    )
    dof1, dof2 = k - 1.0, n - k
    ss = np.maximum(squares - _quotient(offset**2, n), 0.0)
    # Where nothing is repeated, or there is one group, there is no mean square: NaN.
    ms1 = _quotient(ss, np.where(dof1 > 0.0, dof1, np.nan))
    ms2 = _quotient(within, np.where(dof2 > 0.0, dof2, np.nan))
    f = _quotient(ms1, ms2)
    size = _quotient(n, k)
    b = np.where((repeated >= 2.0) & (least > 0.0), repeated - 1.0, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        m = dof2 * np.log(ms2) - logs
        bartlett = np.maximum(m, 0.0) / (1.0 + (inverse - 1.0 / dof2) / (3.0 * b))
    return CellTests(
        mean=_quotient(offset, n),
        sd_all=np.sqrt(_quotient(ss + within, np.where(n > 1.0, n - 1.0, np.nan))),
        sd_pooled=np.sqrt(ms2),
        between=np.sqrt(np.maximum(_quotient(ms1 - ms2, size), 0.0)),
        dof_between=dof1,
        dof_within=dof2,
        ss_between=ss,
        anova_f=f,
        anova_p=f_tail(f, np.maximum(dof1, 1.0), np.maximum(dof2, 1.0)),
        bartlett=np.asarray(bartlett),
        bartlett_p=chi_square_tail(bartlett, np.where(np.isnan(b), 1.0, b)),
    )


def drift_from_sums(
    groups: Array, sum_t: Array, sum_tt: Array, sum_m: Array, sum_mm: Array, sum_tm: Array
) -> CellDrift:
    """Least-squares slope of the group means m over t from their sums, each (c,); NaN below three groups.

    Groups count alike: right where they differ by more than their runs scatter, as campaigns do.
    """
    count = len(np.asarray(groups))
    k, t, tt, m, mm, tm = (
        _checked(array, name, count)
        for array, name in zip(
            (groups, sum_t, sum_tt, sum_m, sum_mm, sum_tm),
            ("groups", "sum_t", "sum_tt", "sum_m", "sum_mm", "sum_tm"),
            strict=True,
        )
    )
    stt, smm, stm = tt - t * t / k, mm - m * m / k, tm - t * m / k
    enough = (k >= 3.0) & (stt > 0.0)
    slope = _quotient(stm, np.where(enough, stt, np.nan))
    dof = np.where(enough, k - 2.0, 1.0)
    u = np.sqrt(_quotient(np.maximum(smm - slope * stm, 0.0) / dof, np.where(enough, stt, np.nan)))
    p_value = 2.0 * student_tail(np.abs(_quotient(slope, u)), dof)
    none = np.full(count, np.nan)
    return CellDrift(slope, u, p_value, none, none, np.abs(_quotient(slope, u)))


def slope_beside(
    groups: Array,
    squares: tuple[Array, Array],
    products: tuple[Array, Array, Array],
    sums: tuple[Array, Array, Array],
) -> Array:
    """Slope (c,) of m over t with a column g fitted beside it, from sums over ``groups``; NaN where g and t are one.

    ``squares`` are the sums of t² and g², ``products`` those of t g, t m and g m, ``sums`` those of t, g and m.
    """
    t, g, m = sums
    stt, sgg = squares[0] - t * t / groups, squares[1] - g * g / groups
    stg, stm, sgm = products[0] - t * g / groups, products[1] - t * m / groups, products[2] - g * m / groups
    determinant = stt * sgg - stg * stg
    # What rounding leaves of the time once the column is taken out of it.
    return _quotient(
        stm * sgg - sgm * stg, np.where(determinant > DEPENDENT**2 * stt * sgg, determinant, np.nan)
    )


def drift_in_blocks(
    drift: CellDrift, blocks: Blocks, *, cycle: float | None = None, u_common: Array | None = None
) -> CellDrift:
    """The drift of every cell with the resemblance of its groups allowed for, as ``trend`` does.

    The slope is that of all groups, or, where a ``cycle`` is fitted beside it, that of the blocks; its uncertainty is
    that of the blocks, that of the season where it may be a part of the slope (``beside_season``), and ``u_common``
    (c,) of the slope by what groups have in common. NaN where they are too few.
    """
    lines = block_lines(blocks, cycle=cycle)
    slope = np.where(lines.cyclic, lines.slope, np.where(np.isfinite(lines.slope), drift.slope, np.nan))
    # Days that differ by rounding alone have no slope.
    slope = np.where((lines.slope == 0.0) & (lines.u_slope == 0.0), 0.0, slope)
    u_slope = lines.u_slope if u_common is None else np.hypot(lines.u_slope, u_common)
    u, p_value, season_p = beside_season(slope, u_slope, lines.dof, lines.seasonal)
    steepness = np.abs(_quotient(slope, u_slope))
    return CellDrift(slope, u, p_value, lines.widening, season_p, steepness, lines)
