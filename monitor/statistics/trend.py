"""Drift of one parameter over runs, campaigns and years: a weighted slope, a robust one, a monotone test.

The weighted slope uses each run's own uncertainty and a between-day component, and allows for days that resemble each
other (``block_lines``); believe it where the three agree. Where only the weighted one says drift, look for an outlier
or a step (``changes``) first.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_matrix, as_positive, as_probability, as_vector
from monitor.statistics.days.block_lines import (
    FEWEST_BLOCKS,
    AgainstSeason,
    BlockLines,
    Blocks,
    block_lines,
    blocks_of_days,
    fits_cycle,
)
from monitor.statistics.days.seasonal_slopes import SeasonAhead, beside_season
from monitor.statistics.mixed import MixedFit, fit_with_days
from monitor.statistics.monotone import MonotoneTrend, mann_kendall, pairs, theil_sen
from monitor.statistics.sums import label_groups


@dataclass(frozen=True)
class Resemblance:
    """How days resembled each other: ``correlation`` of neighbouring ``blocks`` of days, as estimated and ``allowed``.

    ``widening``: the interval of the slope is so many times wider than with independent days. ``cyclic``: a cycle was
    fitted beside the line; ``beside`` columns were as well. ``seasonal``: the history is too short for a cycle, which
    may be a part of the slope: then ``season_p`` of the line is its p-value beside one of any size.
    """

    correlation: float
    allowed: float
    widening: float
    blocks: int
    cyclic: bool
    beside: int
    seasonal: bool = False


#: Days that are taken as independent.
INDEPENDENT = Resemblance(0.0, 0.0, 1.0, 0, False, 0)


@dataclass(frozen=True)
class Trend:
    """A straight line ``level_at + slope (t - at)``; slopes in the unit of the values per unit of the times.

    ``at`` is the mean time, ``covariance`` (2, 2) that of level and slope, ``dof`` the degrees of freedom of
    the slope; ``between`` the day component and ``within`` the factor on the runs' own uncertainties (their
    standard deviation where none were given); ``run_sd`` is the scatter of a run on a day of its own, what a cycle or
    other columns beside the line contribute included. ``robust_interval`` and ``monotone`` are None below 6 days,
    where ranks cannot reach their level; ``monotone`` also where two days have one mean time. ``resemblance`` says
    how far days that resemble each other are allowed for. ``p_value`` says whether the values move, ``season_p``
    whether a season alone moves them; None where none is asked of the line, else ``u_slope`` holds what a season may be
    of it (``beside_season``), which is no part of the ``covariance``: ``season_ahead`` adds it to what is foretold.
    ``beside`` are the coefficients of the columns beside the line, which is that of their means over the runs.
    ``common`` (q, 2) is what level and slope are off by for one standard uncertainty of each of q quantities that runs
    have in common: no part of the ``covariance``, which is of what scatters, but of ``u_slope`` and its interval.
    """

    at: float
    level_at: float
    slope: float
    u_slope: float
    slope_interval: tuple[float, float]
    dof: float
    p_value: float
    covariance: Array
    within: float
    between: float
    run_sd: float
    n: int
    days: int
    confidence: float
    robust_slope: float
    robust_interval: tuple[float, float] | None
    monotone: MonotoneTrend | None
    resemblance: Resemblance = INDEPENDENT
    season_p: float | None = None
    season_ahead: SeasonAhead | None = None
    beside: tuple[float, ...] = ()
    common: Array = field(default_factory=lambda: np.empty((0, 2)))

    def u_common(self, times: npt.ArrayLike) -> Array:
        """Return the standard uncertainty (m,) of the line at ``times`` (m,) by what runs have in common."""
        away = np.asarray(times, dtype=np.float64) - self.at
        off_by = self.common[:, 0] + self.common[:, 1] * away[..., np.newaxis]
        return np.sqrt(np.asarray((off_by**2).sum(axis=-1), dtype=np.float64))


@dataclass(frozen=True)
class _Days:
    """The days of a history: weights of their means, mean times and values, and columns beside the line (d, e)."""

    weight: Array
    time: Array
    value: Array
    beside: Array


def day_averages(
    values: Array, times: Array, u: Array | None, index: npt.NDArray[np.intp]
) -> tuple[Array, Array]:
    """Weighted means of values and times by day, in the order of time."""
    weight = np.ones_like(values) if u is None else 1.0 / u**2
    total = np.bincount(index, weight)
    y, t = np.bincount(index, weight * values) / total, np.bincount(index, weight * times) / total
    order = np.argsort(t, kind="stable")
    return y[order], t[order]


def _blocks(days: _Days) -> Blocks:
    return blocks_of_days(days.weight, days.time, days.value, days.beside)


def _too_few_groups(blocks: int, days: int) -> DataError:
    return DataError(
        f"the {days} days lie in {blocks} groups far apart, which cannot tell a trend from groups that differ; days in "
        f"at least {FEWEST_BLOCKS} are needed."
    )


def _line_of_days(days: _Days, cycle: float | None) -> BlockLines:
    """The line of the blocks of days. Raises ``DataError`` where they are too few."""
    lines = block_lines(_blocks(days), cycle=cycle)
    if not np.isfinite(lines.slope[0]):
        raise _too_few_groups(int(lines.blocks[0]), len(days.time))
    return lines


def _independent(fit: MixedFit, at: float) -> BlockLines:
    """The same where days are taken as independent: what the fit itself says."""
    pick = np.ix_([0, -1], [0, -1])
    unity, none = np.ones(1), np.zeros(1)
    return BlockLines(
        at=np.array([at]), slope=fit.coefficients[-1:], covariance=fit.covariance[pick][np.newaxis], dof=fit.dof[-1:],
        correlation=none, allowed=none, widening=unity, scatter=unity, blocks=np.zeros(1, dtype=np.int64),
        cyclic=np.zeros(1, dtype=np.bool_), seasonal=AgainstSeason(np.full(1, np.nan), np.full(1, np.nan), np.zeros(1)),
    )  # fmt: skip


def _ranked(
    values: Array, times: Array, p: float
) -> tuple[float, tuple[float, float] | None, MonotoneTrend | None]:
    """Theil-Sen slope with its interval, and Mann-Kendall: None below six days, the latter where two have one time."""
    both = pairs(values, times)
    monotone = None
    enough = len(times) >= 6
    if enough and (np.diff(times) > 0.0).all():
        monotone = mann_kendall(values, times, pair_slopes=both)
    inflation = 1.0 if monotone is None else monotone.inflation
    slope, interval = theil_sen(values, times, p, both, inflation)
    return slope, interval if enough else None, monotone


def _in_common(fit: MixedFit, design: Array, common: Array) -> Array:
    """What level and slope (q, 2) are off by for each column of ``common`` (d, q): the fit of the day means on
    ``design`` (d, k) is linear in the values, so that it is the fit of the columns with the weights of the days."""
    if not common.shape[1]:
        return np.empty((0, 2))
    root = np.sqrt(fit.weight / fit.weight.max())[:, np.newaxis]
    scale = np.abs(design).max(axis=0)
    solution = np.linalg.lstsq(root * (design / scale), root * common, rcond=None)[0] / scale[:, np.newaxis]
    return np.asarray(solution[[0, -1]].T)


def _result(
    fit: MixedFit,
    lines: BlockLines,
    at: float,
    y: Array,
    u: Array | None,
    columns: Array,
    common: Array,
    p: float,
) -> Trend:
    """The line without what rests on ranks; ``columns`` (n, e) are what is fitted beside it, ``common`` (q, 2) what
    level and slope are off by."""
    # Days that differ by rounding alone have no slope.
    is_constant = lines.slope[0] == 0.0 and lines.u_slope[0] == 0.0
    slope, dof = 0.0 if is_constant else float(fit.coefficients[-1]), float(lines.dof[0])
    u_of_slope = np.hypot(lines.u_slope, np.linalg.norm(common[:, 1]))
    seasonal = beside_season(np.array([slope]), u_of_slope, lines.dof, lines.seasonal)
    u_slope, season_p = float(seasonal.u[0]), float(seasonal.season_p[0])
    # From the mean time of the blocks to that of the runs.
    shift = np.array([[1.0, at - float(lines.at[0])], [0.0, 1.0]])
    half = -float(scipy.special.stdtrit(dof, (1.0 - p) / 2.0)) * u_slope
    scatter = float(lines.scatter[0])
    run_u = 1.0 if u is None else float(np.sqrt(np.mean(u**2)))
    beside = columns @ fit.coefficients[1:-1]
    run_variance = (fit.within * run_u) ** 2 * (1.0 if fit.repeated else scatter) + fit.between**2 * scatter
    return Trend(
        at=at,
        level_at=float(fit.coefficients[0]),
        slope=slope,
        u_slope=u_slope,
        slope_interval=(slope - half, slope + half),
        dof=dof,
        p_value=float(seasonal.p_value[0]),
        covariance=shift @ lines.covariance[0] @ shift.T,
        within=fit.within * (1.0 if fit.repeated else float(np.sqrt(scatter))),
        between=fit.between * float(np.sqrt(scatter)),
        run_sd=float(np.sqrt(run_variance + np.var(beside))),
        n=len(y),
        days=len(fit.weight),
        confidence=p,
        robust_slope=np.nan,
        robust_interval=None,
        monotone=None,
        resemblance=Resemblance(
            float(lines.correlation[0]), float(lines.allowed[0]), float(lines.widening[0]), int(lines.blocks[0]),
            bool(lines.cyclic[0]), columns.shape[1] - 2 * int(lines.cyclic[0]),
            bool(np.isfinite(lines.seasonal.t[0])),
        ),
        season_p=None if np.isnan(season_p) else season_p,
        beside=tuple(fit.coefficients[1 + 2 * int(lines.cyclic[0]) : -1].tolist()),
        common=common,
    )  # fmt: skip


def _judged_line(days: _Days, cycle: float | None, *, is_cyclic: bool) -> BlockLines:
    """The line of the blocks, with a wave where the fit has one; its weights may bring in one that it does not have."""
    lines = _line_of_days(days, cycle)
    return _line_of_days(days, None) if lines.cyclic[0] and not is_cyclic else lines


def _with_season(line: Trend, alone: BlockLines, t: Array, cycle: float | None) -> Trend:
    """The line with what a season may be of it ahead of its runs at ``t``; ``alone`` is it without one."""
    if line.season_p is None or cycle is None:
        return line
    without = float(alone.u_slope[0]) ** 2 + float((line.common[:, 1] ** 2).sum())
    u = float(np.sqrt(max(line.u_slope**2 - without, 0.0)))
    return replace(
        line,
        season_ahead=SeasonAhead(u, float(t.min()), float(t.max()), cycle, float(alone.seasonal.bend[0])),
    )


def _columns(values: npt.ArrayLike | None, name: str, runs: int) -> Array:
    """Columns (n, e) of so many runs, none where nothing is given. Raises ``DataError`` for another number of rows."""
    columns = np.empty((runs, 0)) if values is None else as_matrix(values, name)
    if len(columns) != runs:
        raise DataError(f"{name} has {len(columns)} rows; {runs} are needed, one for each run.")
    return columns


def trend(
    values: npt.ArrayLike,
    times: npt.ArrayLike,
    *,
    u: npt.ArrayLike | None = None,
    days: npt.ArrayLike | None = None,
    cycle: float | None = None,
    beside: npt.ArrayLike | None = None,
    common: npt.ArrayLike | None = None,
    level: float = 0.95,
    robust: bool = True,
    independent: bool = False,
) -> Trend:
    """Drift of ``values`` (n,), any unit, over ``times`` (n,), any unit.

    ``u`` (n,) standard uncertainties in the unit of the values, without what runs have in common; their common scale is
    estimated. ``common`` (n, q) is what the values are off by for one standard uncertainty of each of q quantities that
    outlast a run (the scale of a laser): the variance of level and slope by each is (sum of weights times column)²
    (JCGM 100:2008, 5.2.2), and Student's distribution of the scatter is kept for the sum, which is a little wide.
    ``days`` (n,) labels whose runs share a day component, and which count at the mean time of the day; None: every run
    is its own day.
    ``cycle`` is the period of a wave that is fitted beside the line where the history covers most of one (the year);
    a shorter history without columns beside the line is judged beside a wave of any size (``beside_season``);
    ``beside`` (n, e) are columns, such as the temperature, that are fitted beside it by their means of each day.
    At least three days. Without ``robust`` what rests on the slopes of all pairs of days is left out (NaN, None):
    a forecast has no use for it. Days that resemble each other are allowed for (``block_lines``), unless they are known
    to be ``independent``. Raises ``DataError`` for fewer days or days in fewer than three groups far apart, for times
    that are all alike, non-finite values, or ``u`` not above zero.
    Measured false alarms at 5 % for correlations of days up to 0.8, day components up to twice the scatter of a run,
    cycles and heavy tails: 0.5 to 8 %, for independent days 0.5 to 4 % (docs/trials-statistics.md).
    """
    y = as_vector(values, "values", least=3)
    t = as_vector(times, "times", length=len(y))
    run_u = None if u is None else as_positive(u, "u", length=len(y))
    columns, shared = _columns(beside, "beside", len(y)), _columns(common, "common", len(y))
    as_probability(level, "level")
    index = np.arange(len(y)) if days is None else label_groups(days, len(y))[1]
    count = int(index.max()) + 1
    if count < 3:
        raise DataError(
            f"a trend over {count} day(s) cannot be told from their scatter; at least 3 are needed."
        )
    if np.ptp(t) == 0.0:
        raise DataError(f"all times are {t[0]}; a trend needs times that differ.")
    # All runs of a day count at its mean time: what happens within a day (a machine that warms up every morning) is
    # scatter of the runs and no drift of years, which a slope within the day would pass itself off as.
    weight = np.ones_like(t) if run_u is None else 1.0 / run_u**2
    total = np.asarray(np.bincount(index, weight), dtype=np.float64)

    def by_day(column: Array) -> Array:
        return np.asarray(np.bincount(index, weight * column) / total, dtype=np.float64)

    time = by_day(t)
    if np.ptp(time) == 0.0:
        raise DataError("all days have the same mean time; a trend needs days that differ.")
    on_day = time[index]
    at = float(on_day.mean())
    plain = _Days(total, time, by_day(y), _side_by_side([by_day(column) for column in columns.T], count))
    wave = _wave(plain, time - at, cycle)
    means = [column - column[index].mean() for column in (*wave.T, *plain.beside.T)]
    beside_line = _side_by_side(means, count)[index]
    design = np.column_stack([np.ones_like(t), beside_line, on_day - at])
    fit = fit_with_days(y, design, run_u, index)
    of_days = _side_by_side([by_day(column) for column in shared.T], count)
    in_common = _in_common(fit, design[np.unique(index, return_index=True)[1]], of_days)
    judged = _Days(fit.weight, time, plain.value, plain.beside)
    lines = _independent(fit, at) if independent else _judged_line(judged, cycle, is_cyclic=wave.size > 0)
    result = _with_season(_result(fit, lines, at, y, run_u, beside_line, in_common, level), lines, t, cycle)
    if not robust:
        return result
    slope, interval, monotone = _ranked(*day_averages(y, t, run_u, index), level)
    return replace(result, robust_slope=slope, robust_interval=interval, monotone=monotone)


def _side_by_side(columns: list[Array], count: int) -> Array:
    return np.column_stack(columns) if columns else np.empty((count, 0))


def _wave(days: _Days, away: Array, cycle: float | None) -> Array:
    """Cosine and sine (d, 2) of the cycle at the days, or nothing (d, 0) where the history does not show it."""
    if cycle is None or not fits_cycle(_blocks(days), cycle)[0]:
        return np.empty((len(away), 0))
    phase = 2.0 * np.pi / cycle * away
    return np.column_stack([np.cos(phase), np.sin(phase)])
