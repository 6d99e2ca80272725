"""The tests of every machine and parameter from its sums, and how urgent what they say is."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy

from monitor.records import Array
from monitor.statistics import control_false_discoveries
from monitor.statistics.days.block_lines import DAYS_AS_BLOCKS, DAYS_OF_BLOCK, MOST_BLOCKS, ROUNDING, Blocks
from monitor.statistics.means import VarianceMoments, brown_forsythe_from_moments
from monitor.statistics.sufficient import (
    CellDrift,
    CellTests,
    cells_from_sums,
    drift_from_sums,
    drift_in_blocks,
    slope_beside,
)
from monitor.store import BlockCut, FleetSums
from monitor.units import DAYS_PER_YEAR
from monitor.workflow.fleet.attention import ATTENTION, Attention
from monitor.workflow.fleet.in_common import common_of_lines
from monitor.workflow.fleet.nearness import Nearness, nearness
from monitor.workflow.history.drift import DAYS_FOR_TEMPERATURE, LEAST_TEMPERATURE_RANGE, SHORTEST_DAYS

#: How histories are cut into blocks: as those of `monitor trend`.
CUT = BlockCut(DAYS_AS_BLOCKS, DAYS_OF_BLOCK, MOST_BLOCKS)
#: A drift that reaches the limit within so many years needs attention now.
SOON_YEARS = 1.0
#: False discovery rate over all machines and parameters.
RATE = 0.05
#: Days of one machine usually differ: they need attention where they scatter so much more than runs.
DAYS_OVER_RUNS = 3.0
#: Fewer days than this make a difference, not a drift.
FEWEST_DAYS = 5
#: The latest day stands out where it lies so many standard deviations of the days from their mean, with so many days.
STANDS_OUT, FEWEST_TO_STAND_OUT = 3.0, 6.0
#: Where a latest day comes in the order of the classes that chance lets stand out among so many rows.
BEHIND_DRIFTS = ATTENTION.index(Attention.DRIFTS) + 0.5


def cell_tests(sums: FleetSums) -> tuple[CellTests, CellDrift]:
    """Bartlett, ANOVA and drift (a day) of every machine and parameter from its sums."""
    cells = cells_from_sums(sums)
    drift = drift_from_sums(sums.groups, sums.sum_t, sums.sum_tt, sums.sum_m, sums.sum_mm, sums.sum_tm)
    beside = warmth_beside(sums)
    degrees = np.where(beside[:, np.newaxis], sums.blocks.degrees, 0.0)[:, :, np.newaxis]
    blocks = Blocks(
        sums.blocks.groups, sums.blocks.t, sums.blocks.m, sums.groups, degrees, origin=sums.origin
    )
    warmth = sums.temperatures
    slopes = slope_beside(
        sums.groups,
        (sums.sum_tt, warmth.sum_gg),
        (warmth.sum_gt, sums.sum_tm, warmth.sum_gm),
        (sums.sum_t, warmth.sum_g, sums.sum_m),
    )
    drift = replace(drift, slope=np.where(beside, slopes, drift.slope))
    u_common = common_of_lines(sums, sums.blocks.groups).u_slope
    in_blocks = drift_in_blocks(drift, blocks, cycle=DAYS_PER_YEAR, u_common=u_common)
    return cells, _without_short_histories(sums, in_blocks)


def warmth_beside(sums: FleetSums) -> npt.NDArray[np.bool_]:
    """Whether the temperature is fitted beside the line of each cell (c,), as for one machine (``PieceDrift``)."""
    warmth = sums.temperatures
    blocks = (sums.blocks.groups > 0.0).sum(axis=1)
    enough = (blocks >= DAYS_FOR_TEMPERATURE) & (warmth.span >= LEAST_TEMPERATURE_RANGE)
    return np.asarray((warmth.groups == sums.groups) & enough)


def means_p(sums: FleetSums) -> Array:
    """Return p-values (c,) of equal means of the days, whatever their scatter: Brown and Forsythe's test."""
    repeated = sums.repeated_sums
    with np.errstate(divide="ignore", invalid="ignore"):
        between = np.maximum(repeated.squares - repeated.offset**2 / repeated.runs, 0.0)
    moments = VarianceMoments(
        groups=sums.repeated, runs=repeated.runs, between=between, first=repeated.s2,
        first_runs=repeated.s2_runs, second=repeated.s4, second_runs=repeated.s4_runs, by_dof=repeated.s4_dof,
    )  # fmt: skip
    return brown_forsythe_from_moments(moments)[3]


def _without_short_histories(sums: FleetSums, drift: CellDrift) -> CellDrift:
    """No slope a year from less than ``SHORTEST_DAYS``: evenly spread days have a standard deviation of their span
    over the root of 12."""
    mean = sums.sum_t / sums.groups
    spread = np.sqrt(np.maximum(sums.sum_tt / sums.groups - mean**2, 0.0))
    short = spread < SHORTEST_DAYS / np.sqrt(12.0)
    columns = (drift.slope, drift.u, drift.p_value, drift.widening, drift.season_p, drift.steepness)
    slope, u, p_value, widening, season_p, steepness = (np.where(short, np.nan, values) for values in columns)
    return CellDrift(slope, u, p_value, widening, season_p, steepness, drift.lines)


def _level(sums: FleetSums, drift: CellDrift) -> Array:
    """Where the line of each cell is on the last day, from which trend page and report forecast, too.

    The mean of that day alone scatters as runs and days do, and so would the day on which the limit is reached.
    """
    ahead = sums.last_d - sums.epoch_d - sums.sum_t / sums.groups
    return np.asarray(sums.origin + sums.sum_m / sums.groups + drift.slope * ahead)


@dataclass(frozen=True, eq=False)
class Ranking:
    """How urgent each cell is: its class ``kind`` (c,), 0 the most urgent; ``urgency`` (c,) by which classes are
    sorted, smaller first; its ``measure`` within that (c,), larger first; ``years`` to the limit (c,), NaN where no
    sure drift reaches it within a year; how near the limit is (``near``)."""

    kind: npt.NDArray[np.int64]
    urgency: Array
    measure: Array
    years: Array
    near: Nearness


def _latest_day(sums: FleetSums, cells: CellTests) -> tuple[Array, Array]:
    """How many standard deviations of the other days the latest one lies from their mean (c,), NaN of few days; and
    the p-value of that (c,), by Student's t distribution with the degrees of freedom of those days."""
    with np.errstate(divide="ignore", invalid="ignore"):
        # Against the other days: the latest one, with those that overlap it, is taken out of their mean.
        k = sums.groups - sums.latest_groups + 1.0
        others = (sums.sum_m - sums.latest_m) / (k - 1.0)
        squares = sums.sum_mm - sums.latest_mm - (k - 1.0) * others**2
        variance = np.maximum(squares, 0.0) / (k - 2.0) * (1.0 + 1.0 / (k - 1.0))
        # A day of few runs after days of many: what the mean of its runs scatters more than theirs do.
        fewer = 1.0 / sums.latest_runs - (k - 1.0) / (sums.runs - sums.latest_runs)
        sd = np.sqrt(variance + np.nan_to_num(cells.sd_pooled) ** 2 * np.maximum(fewer, 0.0))
        z = np.abs(sums.latest - others) / np.where(k >= FEWEST_TO_STAND_OUT, sd, np.nan)
        latest = np.abs(sums.origin + sums.latest)
        z = np.where(np.abs(sums.latest - others) <= ROUNDING * latest, 0.0, z)
    return z, 2.0 * scipy.special.stdtr(np.maximum(k - 2.0, 1.0), -z)


def ranked(sums: FleetSums, cells: CellTests, drift: CellDrift, drift_q: Array, limit: Array) -> Ranking:
    """Rank the cells. A latest day that chance alone lets stand out among as many rows (false discoveries above
    ``RATE``) comes behind the drifts, which chance does not make."""
    share = np.abs(sums.origin + sums.latest) / limit
    per_year = drift.slope * DAYS_PER_YEAR
    level = _level(sums, drift)
    near = nearness(sums, cells, drift, level, limit)
    with np.errstate(divide="ignore", invalid="ignore"):
        years = (np.where(per_year >= 0.0, limit, -limit) - level) / per_year
        ratio = cells.between / cells.sd_pooled
    z, p_value = _latest_day(sums, cells)
    by_chance = ~(control_false_discoveries(p_value, rate=RATE).q_value < RATE)
    drifting = (drift_q < RATE) & (sums.groups >= FEWEST_DAYS)
    soon = drifting & (years >= 0.0) & (years < SOON_YEARS)
    number = {label: index for index, label in enumerate(ATTENTION)}
    kind = np.where(sums.groups < 2.0, number[Attention.ONE_DAY], number[Attention.AS_USUAL])
    measure = np.nan_to_num(ratio, nan=0.0, posinf=0.0)
    for label, holds, size in (
        (Attention.DAYS_DIFFER, ratio > DAYS_OVER_RUNS, ratio),
        (Attention.DRIFTS, drifting, drift.steepness),
        (Attention.STANDS_OUT, (z > STANDS_OUT) & ~(drifting & by_chance), z),
        (Attention.DRIFTS_OUT, soon, -years),
        (Attention.DUE, near.may_be_out_at_check, -near.inside),
        (Attention.MAY_BE_OUT, near.may_be_out, near.out),
        (Attention.OUT, (share >= 1.0) | (near.out > 0.5), share),
    ):
        mask = np.asarray(holds, dtype=np.bool_)
        kind[mask], measure[mask] = number[label], np.nan_to_num(size)[mask]
    chance = (kind == number[Attention.STANDS_OUT]) & by_chance
    return Ranking(kind, np.where(chance, BEHIND_DRIFTS, kind), measure, np.where(soon, years, np.nan), near)
