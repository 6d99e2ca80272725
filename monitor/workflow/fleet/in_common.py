"""What the lines of a fleet are off by because their days rest on the same calibrations, from sums.

As of one machine (``Trend.common``): a line through the means of groups is linear in them, so that what it is off by
for one standard uncertainty of a quantity is the line through what the groups are off by. Neglected: the temperature
or the wave beside some lines, which changes the weights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.store import FleetSums


@dataclass(frozen=True)
class CommonOfLines:
    """By quantity and line what its level at the mean time ``at`` and its slope are off by, all (m,); ``cell`` (m,)
    numbers the lines, of which there are ``count``."""

    cell: npt.NDArray[np.intp]
    level: Array
    slope: Array
    at: Array
    count: int

    @property
    def u_slope(self) -> Array:
        """Standard uncertainty (c,) of the slopes by what is in common."""
        return np.sqrt(np.bincount(self.cell, self.slope**2, self.count))

    def u_at(self, times: Array) -> Array:
        """Standard uncertainty (c,) of the lines at ``times`` (c,)."""
        off_by = self.level + self.slope * (times - self.at)[self.cell]
        return np.sqrt(np.bincount(self.cell, off_by**2, self.count))


def common_of_lines(
    sums: FleetSums, groups: Array, rows: npt.NDArray[np.intp] | None = None
) -> CommonOfLines:
    """Return what is in common of the lines of some cells (``rows``; None: all) through the ``groups`` (r, b) of each
    block that count, all of a block or none."""
    common, blocks = sums.common, sums.blocks
    count = len(groups)
    selected = np.arange(count) if rows is None else rows
    line_of = np.full(len(sums.machine), -1)
    line_of[selected] = np.arange(count)
    line = line_of[common.cell]
    # Blocks of which no group counts have no column.
    used = (line >= 0) & (common.block < groups.shape[1])
    used[used] = groups[line[used], common.block[used]] > 0.0
    # Line and quantity as one number: rows of two are sorted some fifty times slower.
    quantities = int(common.quantity.max(initial=0)) + 1
    pair, pair_of_row = np.unique(line[used] * quantities + common.quantity[used], return_inverse=True)
    p, tp = (np.bincount(pair_of_row, column[used], len(pair)) for column in (common.p, common.tp))
    t = blocks.t[selected]
    number = np.maximum(groups.sum(axis=1), 1.0)
    at = (groups * t).sum(axis=1) / number
    if rows is None:
        squares = sums.sum_tt - sums.sum_t**2 / number
    else:
        squares = (groups * (t - at[:, np.newaxis]) ** 2).sum(axis=1)
    cell = pair // quantities
    slope = (tp - at[cell] * p) / np.where(squares[cell] > 0.0, squares[cell], np.inf)
    return CommonOfLines(cell, p / number[cell], slope, at, count)
