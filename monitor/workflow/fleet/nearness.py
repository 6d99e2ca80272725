"""How near to its limit every machine and parameter is: out already, by its last run, or at the next check.

Both probabilities are those that the weekly report and `monitor trend` state, from the sums that the fleet has: the
value and standard uncertainty of the last run, and the drift ahead with the scatter of days and runs about it. `trend`
cuts a history at every change that it finds; here one that is a step rather than a line is cut at that step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from monitor.records import Array
from monitor.statistics.days.block_lines import ROUNDING, BlockLines, Blocks, block_lines
from monitor.statistics.days.seasonal_slopes import SeasonAhead, beside_season
from monitor.statistics.sufficient import CellDrift, CellTests
from monitor.store import FleetSums
from monitor.units import DAYS_PER_YEAR
from monitor.workflow.fleet.in_common import CommonOfLines, common_of_lines
from monitor.workflow.fleet.steps import split_times
from monitor.workflow.history.beyond_limit import RISK
from monitor.workflow.history.drift import SHORTEST_DAYS
from monitor.workflow.history.forecast import RELIABILITY


@dataclass(frozen=True, eq=False)
class Nearness:
    """Of c cells, NaN where there is no limit: ``out`` (c,) is the probability that the last run is beyond it,
    ``inside`` (c,) that a run at the next check is not; ``any_out`` (c,) that any parameter of the machine is out.

    ``is_worst`` (c,) holds for the parameter of each machine that is out with the largest probability.
    """

    out: Array
    inside: Array
    any_out: Array
    is_worst: npt.NDArray[np.bool_]

    @property
    def may_be_out(self) -> npt.NDArray[np.bool_]:
        """Whether a cell, or as the worst one its machine, is out with more than the risk of the weekly report."""
        return np.asarray((self.out > RISK) | (self.is_worst & (self.any_out > RISK)))

    @property
    def may_be_out_at_check(self) -> npt.NDArray[np.bool_]:
        """Whether a run at the next check is in tolerance with less than the wanted probability."""
        return np.asarray(self.inside < RELIABILITY)


def nearness(sums: FleetSums, cells: CellTests, drift: CellDrift, level: Array, limit: Array) -> Nearness:
    """Return how near every cell is to ± ``limit`` (c,); ``level`` (c,) is where its line is on the last day."""
    out = probability_out(sums.last_value, sums.last_u, limit)
    index = np.unique(sums.machine, return_inverse=True)[1]
    # Parameters of one run taken as independent: with correlations, which no sum has, it is no more than a little less.
    single = np.nan_to_num(out)
    none_out = np.zeros(int(index.max()) + 1)
    np.add.at(none_out, index, np.log1p(-np.minimum(single, 1.0 - 1e-15)))
    any_out = -np.expm1(none_out)
    worst = np.zeros(len(none_out))
    np.maximum.at(worst, index, single)
    is_worst = (single > 0.0) & (single == worst[index])
    return Nearness(out, _inside(sums, cells, drift, level, limit), any_out[index], is_worst)


def probability_out(value: Array, u: Array, limit: Array) -> Array:
    """Return the probability (c,) that values with standard uncertainties lie beyond ± ``limit`` (JCGM 106:2012, 7)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        below, above = (-limit - value) / u, (value - limit) / u
    return np.asarray(scipy.special.ndtr(below) + scipy.special.ndtr(above))


def _inside(sums: FleetSums, cells: CellTests, drift: CellDrift, level: Array, limit: Array) -> Array:
    """Return the probability (c,) that a run at the next check is in tolerance; NaN without a drift or a limit.

    A history that is a step rather than a line is judged by the days since the step, as `trend` does.
    """
    if drift.lines is None:
        return np.full(len(limit), np.nan)
    k = sums.groups
    with np.errstate(divide="ignore", invalid="ignore"):
        stt, stm, smm = (
            sums.sum_tt - sums.sum_t**2 / k, sums.sum_tm - sums.sum_t * sums.sum_m / k, sums.sum_mm - sums.sum_m**2 / k
        )  # fmt: skip
        about = np.maximum(smm - 2.0 * drift.slope * stm + drift.slope**2 * stt, 0.0) / (k - 2.0)
        of_run = np.nan_to_num(cells.sd_pooled) ** 2 * np.maximum(1.0 - k / sums.runs, 0.0)
    at = sums.check_d - sums.epoch_d
    value = level + drift.slope * (sums.check_d - sums.last_d)
    ends = sums.last_d - sums.epoch_d
    common = common_of_lines(sums, sums.blocks.groups)
    line = _LineAhead(drift.lines, value, about, drift.u, sums.first_d - sums.epoch_d, ends, common)
    inside = line.inside(at, of_run, limit)
    doubted = np.flatnonzero(inside < RELIABILITY)
    if doubted.size:
        after = _since_step(sums, doubted)
        stepped = (after < sums.blocks.groups[doubted]).any(axis=1)
        rows = doubted[stepped]
        if rows.size:
            since = _line_since(sums, rows, after[stepped], at[rows])
            inside[rows] = since.inside(at[rows], of_run[rows], limit[rows])
    return inside


@dataclass(frozen=True, eq=False)
class _LineAhead:
    """Lines of c cells: their ``value`` at the next check, the variance of a day ``about`` them, ``u`` of the slope
    with its season, and when the days they go through begin and end, in days as those of the lines; what their days
    have in ``common``."""

    lines: BlockLines
    value: Array
    about: Array
    u: Array
    begins: Array
    ends: Array
    common: CommonOfLines

    def inside(self, at: Array, of_run: Array, limit: Array) -> Array:
        """Return the probability (c,) that a run, of variance ``of_run`` about its day, lies within ± ``limit``.

        As ``statistics.predict``: the line with its uncertainty, what a season may be of it, and the scatter of a run
        on a day of its own, by Student's t distribution with the degrees of freedom of the blocks.
        """
        c = self.lines.covariance
        with np.errstate(divide="ignore", invalid="ignore"):
            t = at - self.lines.at
            of_line = c[:, 0, 0] + 2.0 * t * c[:, 0, 1] + t**2 * c[:, 1, 1]
            of_slope = np.sqrt(np.maximum(self.u**2 - c[:, 1, 1] - self.common.u_slope**2, 0.0))
            bend = np.nan_to_num(self.lines.seasonal.bend)
            of_season = np.nan_to_num(
                SeasonAhead(of_slope, self.begins, self.ends, DAYS_PER_YEAR, bend).at(at)
            )
            spread = np.maximum(of_line, 0.0) + of_season**2 + self.about * self.lines.scatter + of_run
            spread += self.common.u_at(at) ** 2
            u = np.maximum(np.sqrt(spread), 1e-300)
            dof = np.where(self.lines.dof > 0.0, self.lines.dof, np.nan)
            above, below = (limit - self.value) / u, (-limit - self.value) / u
        return np.asarray(scipy.special.stdtr(dof, above) - scipy.special.stdtr(dof, below))


def _since_step(sums: FleetSums, rows: npt.NDArray[np.intp]) -> Array:
    """Return the days in each block (r, b) of some cells, none before the step of a history that is one.

    It is where two levels leave less than half of the squares that a line leaves: of a drift they leave more.
    """
    blocks = sums.blocks
    groups, t, m = blocks.groups[rows], blocks.t[rows], blocks.m[rows]
    step_d = split_times(sums)[rows, np.newaxis] - sums.epoch_d
    after = np.where(t >= step_d - ROUNDING, groups, 0.0)
    of_levels = _squares_left(groups - after, None, m) + _squares_left(after, None, m)
    is_step = of_levels < 0.5 * _squares_left(groups, t, m)
    return np.where(is_step[:, np.newaxis], after, groups)


def _squares_left(groups: Array, t: Array | None, m: Array) -> Array:
    """Return what a level, or a line over ``t``, leaves of the squares of the block means ``m``, all (r, b)."""

    def centred(column: Array) -> Array:
        total = np.maximum(groups.sum(axis=1, keepdims=True), 1.0)
        return np.asarray(column - (groups * column).sum(axis=1, keepdims=True) / total)

    deviation = centred(m)
    if t is not None:
        time = centred(t)
        squares = np.maximum((groups * time**2).sum(axis=1, keepdims=True), 1e-300)
        deviation = deviation - time * (groups * time * deviation).sum(axis=1, keepdims=True) / squares
    return np.asarray((groups * deviation**2).sum(axis=1))


def _line_since(sums: FleetSums, rows: npt.NDArray[np.intp], groups: Array, at: Array) -> _LineAhead:
    """Return the lines of some cells through the days (r, b) since their steps; NaN where those are too few."""
    t, m = sums.blocks.t[rows], sums.blocks.m[rows]
    lines = block_lines(Blocks(groups, t, m, groups.sum(axis=1)), cycle=DAYS_PER_YEAR)
    used = groups > 0.0
    first, last = np.where(used, t, np.inf).min(axis=1), np.where(used, t, -np.inf).max(axis=1)
    days = groups.sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean_t, mean = (groups * t).sum(axis=1) / days, (groups * m).sum(axis=1) / days
        slope = np.where(last - first >= SHORTEST_DAYS, lines.slope, np.nan)
        deviation = m - mean[:, np.newaxis] - slope[:, np.newaxis] * (t - mean_t[:, np.newaxis])
        about = (groups * deviation**2).sum(axis=1) / (used.sum(axis=1) - 2.0)
    common = common_of_lines(sums, groups, rows)
    u = beside_season(slope, np.hypot(lines.u_slope, common.u_slope), lines.dof, lines.seasonal).u
    value = sums.origin[rows] + mean + slope * (at - mean_t)
    return _LineAhead(lines, value, about, u, first, last, common)
