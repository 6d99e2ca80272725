"""Where the days of a history differ most from those before, from its blocks."""

from __future__ import annotations

import numpy as np

from monitor.records import Array
from monitor.store import FleetSums


def split_times(sums: FleetSums) -> Array:
    """Return when the days after differ most from those before (c,), in days since 1970, NaN of a single block.

    Between two blocks the one split whose means explain most of the squares; the time is that of the block after it,
    its mean where it holds several days. A description: whether anything happened there, `trend` tests.
    """
    blocks = sums.blocks
    groups, total = blocks.groups, blocks.groups.sum(axis=1, keepdims=True)
    weighted = np.where(groups > 0.0, groups * blocks.m, 0.0)
    before, sum_before = groups.cumsum(axis=1)[:, :-1], weighted.cumsum(axis=1)[:, :-1]
    after, sum_after = total - before, weighted.sum(axis=1, keepdims=True) - sum_before
    with np.errstate(divide="ignore", invalid="ignore"):
        between = before * after / total * (sum_after / after - sum_before / before) ** 2
    # A split before an empty block is that before the next one which has days.
    explained = np.where((before > 0.0) & (groups[:, 1:] > 0.0), np.nan_to_num(between, nan=-1.0), -1.0)
    if explained.shape[1] == 0:
        return np.full(len(groups), np.nan)
    best = explained.argmax(axis=1)
    rows = np.arange(len(groups))
    return np.where(explained[rows, best] >= 0.0, sums.epoch_d + blocks.t[rows, best + 1], np.nan)
