"""Backtest of forecasts of the drift: every day foretold by the days before it, all days at once.

The line of ``trend``, fitted anew to the history before every forecast day. Such a line depends on the days alone
(their weights, means and times), so the fits of all origins are sums over the same days and are solved together: the
work of one fit for each of 255 days becomes some products of matrices. So are the blocks by which ``block_lines``
allows
for days that resemble each other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_positive, as_probability, as_vector
from monitor.statistics.days.block_lines import (
    Blocks,
    block_count,
    block_lines,
    block_of,
    fits_cycle,
)
from monitor.statistics.days.seasonal_slopes import SeasonAhead, beside_season
from monitor.statistics.mixed import LARGEST, STEPS
from monitor.statistics.sums import label_groups

#: Origins solved at a time: the weights of all days for each are held at once.
BLOCK = 128


@dataclass(frozen=True)
class Backtest:
    """Forecasts of held-out days: ``covered`` of ``forecasts`` runs lay in their prediction interval (``level``).

    ``bias`` and ``rms`` of observed less predicted; ``z`` (forecasts,) the same in units of the stated uncertainty.
    """

    forecasts: int
    covered: int
    level: float
    bias: float
    rms: float
    z: Array

    @property
    def coverage(self) -> float:
        """Share of held-out runs inside."""
        return self.covered / self.forecasts


class _Days(NamedTuple):
    """d days in the order of time: weight, mean, time (d,); sums over the days up to each (d,) of runs, of squares
    within the days and of the squared uncertainties of the runs; ``first`` (d,), the first run of each, ``latest``
    (d,) its last time; the time of the ``earliest`` run."""

    weight: Array
    mean: Array
    time: Array
    runs: Array
    within: Array
    u_squared: Array
    first: npt.NDArray[np.intp]
    latest: Array
    earliest: float


def _by_day(y: Array, t: Array, u: Array | None, index: npt.NDArray[np.intp]) -> _Days:
    count = int(index.max()) + 1
    starts = np.full(count, np.inf)
    np.minimum.at(starts, index, t)
    order = np.argsort(starts, kind="stable")
    rank = np.argsort(order)[index]
    weight = np.ones_like(y) if u is None else 1.0 / u**2
    total = np.bincount(rank, weight)
    latest = np.full(count, -np.inf)
    np.maximum.at(latest, rank, t)
    mean = np.bincount(rank, weight * y) / total
    square = np.ones_like(y) if u is None else u**2
    return _Days(
        weight=np.asarray(total, dtype=np.float64),
        mean=mean,
        time=np.bincount(rank, weight * t) / total,
        runs=np.cumsum(np.bincount(rank)).astype(np.float64),
        within=np.cumsum(np.bincount(rank, weight * (y - mean[rank]) ** 2)),
        u_squared=np.cumsum(np.bincount(rank, square)),
        first=np.unique(rank, return_index=True)[1],
        latest=latest,
        earliest=float(t.min()),
    )


class _Lines(NamedTuple):
    """Lines of k origins: place and value of their weighted means, slopes, chi-square of the day means about them, its
    derivative by the day component, the variance of a wave beside them, each (k,), and the weights of the days (k,
    d)."""

    at: Array
    level: Array
    slope: Array
    chi_square: Array
    derivative: Array
    of_wave: Array
    weight: Array


def _lines(
    days: _Days, is_past: npt.NDArray[np.bool_], variance: Array, waves: npt.NDArray[np.bool_], cycle: float
) -> _Lines:
    """Return lines through the past days, ``is_past`` (k, d), with a component of ``variance`` (k,) of the scatter.

    Where ``waves`` (k,) holds, a wave of the period ``cycle`` is fitted beside the line.
    """
    d = is_past.shape[1]
    t, m = days.time[:d], days.mean[:d]
    weight = is_past * (days.weight[:d] / (1.0 + variance[:, np.newaxis] * days.weight[:d]))
    # About the mean of each origin: a few early days may lie close together, and their scatter far below their level.
    total = weight.sum(axis=1)
    at, level = weight @ t / total, weight @ m / total
    time, residual = t - at[:, np.newaxis], m - level[:, np.newaxis]
    spread = np.einsum("kd,kd,kd->k", weight, time, time)
    slope = np.einsum("kd,kd,kd->k", weight, time, residual) / spread
    residual -= slope[:, np.newaxis] * time
    of_wave = np.zeros(len(at))
    if waves.any():
        rows = np.flatnonzero(waves)
        change, of_wave[rows], left_over = _beside_wave(
            days, weight[rows], time[rows], residual[rows], is_past[rows], cycle
        )
        level[rows] += change[:, 0]
        slope[rows] += change[:, 1]
        residual[rows] = left_over
    residual = np.where(is_past, residual, 0.0)
    weighted = weight * residual
    chi_square, derivative = (
        np.einsum("kd,kd->k", weighted, residual),
        -np.einsum("kd,kd->k", weighted, weighted),
    )
    return _Lines(at, level, slope, chi_square, derivative, of_wave, weight)


def _beside_wave(
    days: _Days, weight: Array, time: Array, residual: Array, is_past: npt.NDArray[np.bool_], cycle: float
) -> tuple[Array, Array, Array]:
    """What a wave beside the line changes in level and slope (k, 2), its variance (k,), and what it leaves (k, d)."""
    phase = 2.0 * np.pi / cycle * time
    runs = np.diff(days.runs[: time.shape[1]], prepend=0.0) * is_past
    span = np.ptp(np.where(is_past, time, 0.0), axis=1)[:, np.newaxis]
    columns = [np.ones_like(time), time / span]
    for wave in (np.cos(phase), np.sin(phase)):
        # Centred as ``trend`` does: the level is that at the mean of the runs.
        columns.append(wave - ((runs * wave).sum(axis=1) / runs.sum(axis=1))[:, np.newaxis])
    design = np.stack(columns, axis=2)
    weighted = design * weight[:, :, np.newaxis]
    matrix = np.einsum("kdp,kdq->kpq", weighted, design, optimize=True)
    right = np.einsum("kdp,kd->kp", weighted, residual)
    solution = np.linalg.solve(matrix, right[:, :, np.newaxis])[:, :, 0]
    left_over = residual - np.einsum("kdp,kp->kd", design, solution)
    wave = np.einsum("kdp,kp->kd", design[:, :, 2:], solution[:, 2:])
    variance = (runs * wave**2).sum(axis=1) / runs.sum(axis=1)
    return np.column_stack([solution[:, 0], solution[:, 1] / span[:, 0]]), variance, left_over


def _blocks(days: _Days, past: npt.NDArray[np.intp], weight: Array) -> Blocks:
    """The past days of each origin cut into blocks; ``weight`` (k, d) of the days."""
    d = weight.shape[1]
    time, value = days.time[:d], days.mean[:d]
    number = block_count(past)
    last = np.maximum.accumulate(time)[past - 1]
    first = np.minimum.accumulate(time)[past - 1]
    block = block_of(time[np.newaxis], number[:, np.newaxis], first[:, np.newaxis], last[:, np.newaxis])
    most = int(number.max())
    cell = (np.arange(len(past))[:, np.newaxis] * most + block).ravel()

    def summed(column: Array) -> Array:
        return np.asarray(np.bincount(cell, column.ravel(), len(past) * most).reshape(len(past), most))

    total = summed(weight)
    divisor = np.where(total > 0.0, total, 1.0)
    return Blocks(
        total, summed(weight * time) / divisor, summed(weight * value) / divisor, past.astype(np.float64)
    )


def _forecasts(
    days: _Days, past: npt.NDArray[np.intp], t: Array, cycle: float | None
) -> tuple[Array, Array, Array]:
    """Prediction at ``t`` (k,), standard uncertainty of one run there, and degrees of freedom, from ``past`` (k,) days.

    As ``trend`` and ``predict`` do: a line whose times are those of the days lies between the days alone. NaN where the
    days lie in too few groups.
    """
    last = past - 1
    runs, within = days.runs[last], days.within[last]
    repeated = runs > past
    unit = np.where(repeated, within / np.where(repeated, runs - past, 1.0), 1.0)
    inside = np.where(repeated, within, 0.0)
    is_past = np.arange(int(past.max())) < past[:, np.newaxis]
    waves, period = np.zeros(len(past), dtype=np.bool_), 1.0 if cycle is None else cycle
    if cycle is not None:
        waves = fits_cycle(_blocks(days, past, is_past * days.weight[: is_past.shape[1]]), cycle)
    columns = np.where(waves, 4.0, 2.0)
    goal = (runs - columns) * unit
    variance = np.zeros(len(past))
    lines = _lines(days, is_past, variance, waves, period)
    open_ = (lines.chi_square + inside > goal) & (goal > 0.0) & (past > columns)
    most = LARGEST / np.maximum.accumulate(days.weight)[last]
    for _ in range(STEPS):
        if not open_.any():
            break
        # Newton's steps on the reciprocal, see ``fit_with_days``.
        excess = lines.chi_square + inside - goal
        step = lines.chi_square * excess / ((goal - inside) * -np.where(open_, lines.derivative, -1.0))
        variance = np.where(open_, np.minimum(variance + step, most), variance)
        lines = _lines(days, is_past, variance, waves, period)
        excess_after = lines.chi_square + inside - goal
        open_ &= (excess_after > 1e-13 * goal) & (step > 1e-14 * variance) & (variance < most)
    factor = (lines.chi_square + inside) / (runs - columns)
    judged = block_lines(_blocks(days, past, lines.weight), cycle=cycle)
    run_variance = np.where(repeated, unit, factor * judged.scatter) * days.u_squared[last] / runs
    away, from_blocks = t - lines.at, t - judged.at
    c = judged.covariance
    of_line = c[:, 0, 0] + 2.0 * from_blocks * c[:, 0, 1] + from_blocks**2 * c[:, 1, 1]
    # What the season may be of the slope turns the line from the last run on, as in ``predict``.
    widened = beside_season(lines.slope, judged.u_slope, judged.dof, judged.seasonal).u
    if cycle is not None:
        season_u = np.sqrt(np.maximum(widened**2 - c[:, 1, 1], 0.0))
        ends = np.maximum.accumulate(days.latest)[last]
        of_line += SeasonAhead(season_u, days.earliest, ends, cycle, judged.seasonal.bend).at(t) ** 2
    spread = of_line + run_variance + variance * unit * judged.scatter + lines.of_wave
    return lines.level + lines.slope * away, np.sqrt(spread), judged.dof


def backtest(
    values: npt.ArrayLike,
    times: npt.ArrayLike,
    *,
    u: npt.ArrayLike | None = None,
    days: npt.ArrayLike | None = None,
    cycle: float | None = None,
    most: int | None = None,
    ahead: int = 1,
    first: int = 5,
    level: float = 0.95,
) -> Backtest:
    """Forecast each day from the ``first`` on by the history up to ``ahead`` days before it, at ``most`` so many of
    them.

    Arguments as in ``trend``. Only the first run of a forecast day counts, so that the counted errors are
    not copies of one day's. Raises ``DataError`` where the history has fewer than first + ahead days, or the first
    days all have the same time. The numbers are those of ``trend`` and ``predict`` for every day by itself
    (tests/statistics/test_forecast.py).
    """
    y = as_vector(values, "values", least=3)
    t = as_vector(times, "times", length=len(y))
    run_u = None if u is None else as_positive(u, "u", length=len(y))
    as_probability(level, "level")
    index = np.arange(len(y)) if days is None else label_groups(days, len(y))[1]
    count = int(index.max()) + 1
    if first < 3 or ahead < 1:
        raise DataError(
            f"first is {first}, ahead is {ahead}; at least 3 days of history and 1 ahead are needed."
        )
    if count < first + ahead:
        raise DataError(f"the history has {count} days; first + ahead = {first + ahead} are needed.")
    day_sums = _by_day(y, t, run_u, index)
    if np.ptp(day_sums.time[:first]) == 0.0:
        raise DataError("the first days have the same mean time; a trend needs days that differ.")
    targets = np.arange(first + ahead - 1, count)
    if most is not None and len(targets) > most:
        targets = targets[np.linspace(0, len(targets) - 1, most).round().astype(int)]
    target_runs = day_sums.first[targets]
    blocks = [slice(start, start + BLOCK) for start in range(0, len(targets), BLOCK)]
    forecasts = [
        _forecasts(day_sums, targets[block] - ahead + 1, t[target_runs[block]], cycle) for block in blocks
    ]
    predicted, spread, dof = (np.concatenate(part) for part in zip(*forecasts, strict=True))
    # Days in two groups far apart foretell nothing.
    foretold = np.isfinite(spread)
    if not foretold.any():
        raise DataError("the days lie in two groups far apart, which foretell nothing of the next.")
    predicted, spread, dof, target_runs = (
        predicted[foretold],
        spread[foretold],
        dof[foretold],
        target_runs[foretold],
    )
    errors = y[target_runs] - predicted
    z = errors / np.maximum(spread, 1e-300)
    inside = int((np.abs(z) <= -scipy.special.stdtrit(dof, (1.0 - level) / 2.0)).sum())
    return Backtest(len(z), inside, level, float(errors.mean()), float(np.sqrt((errors**2).mean())), z)
