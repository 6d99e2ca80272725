"""Grids of positions that stand askew to an axis: between two of them it stands some mm elsewhere, as the others say.

The balls of a plate that lies 10 mrad askew are no grid of Y: from column to column Y is 1 mm on. A cycle of Y that
goes round whole times from ball to ball shows nothing along a column, and from column to column a part of a period:
that is how Y bends along X, and no reading tells the two apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import numpy.typing as npt

from monitor.effects import Context
from monitor.records import Array

# Touches of one nominal place scatter by less than this; those of the next place stand farther on.
SAME_STOP_MM = 2.0
# What the other axes do not say of a position within a stop: more, and positions lie anyhow.
TOLERANCE_MM = 0.5
# Steps are multiples of the least one to this part of it.
SAME_STEP = 0.02
# Along its own grid fewer periods than this are flat, or a slope.
FLAT_PERIODS = 0.5
# Within the stops fewer periods than this are a bend along another axis.
BEND_PERIODS = 2.0


def series_of_setups(context: Context) -> list[npt.NDArray[np.int64]]:
    """The rows of each setup of each run: a plate that is laid anew is the same grid elsewhere."""
    setup = np.zeros(len(context), dtype=np.int64)
    if context.instruments is not None:
        setup = context.instruments.setup
    _, of = np.unique(np.stack([context.run, setup]), axis=1, return_inverse=True)
    return [np.flatnonzero(of.reshape(-1) == number) for number in range(of.max(initial=-1) + 1)]


def is_bend_of_another(pitch: float, joint: int, context: Context) -> bool:
    """Whether a cycle of a linear axis shows nothing along the grids of its positions, and a bend along other axes
    where these stand askew: in no setup more, and in one of them that bend."""
    grids = context.remembered(_grids_of, joint, partial(_grids_of, context, joint))
    steps, travels, within = grids.reshape(-1, 3).T
    if np.isnan(steps).any() or not np.any(within > TOLERANCE_MM):
        return False
    turns = steps / pitch
    # Of a single stop there is no way along it.
    flat = np.abs(turns - np.round(turns)) * travels / steps < FLAT_PERIODS
    return bool(np.all(flat & (within < BEND_PERIODS * pitch)))


def other_bounds(pitch: float, pitches: Array, joint: int, context: Context) -> tuple[float, float]:
    """The nearest of some pitches, below and above one, at which a cycle would be the bend of another axis; 0 and
    infinity where there is none, or where it is that itself."""
    if is_bend_of_another(pitch, joint, context):
        return 0.0, float("inf")
    bends = np.array([each for each in pitches.tolist() if is_bend_of_another(each, joint, context)])
    below, above = bends[bends < pitch], bends[bends > pitch]
    return float(below.max(initial=0.0)), float(above.min(initial=np.inf))


def _grids_of(context: Context, joint: int) -> Array:
    """The step, the travel and what lies within a stop (k, 3) in mm, of the grid in each setup of each run, NaN of
    positions that lie anyhow."""
    linear = [index for index, each in enumerate(context.chain.joints) if not each.turns and index != joint]
    return np.array(
        [
            _grid(context.positions[rows, joint], context.positions[rows][:, linear])
            for rows in series_of_setups(context)
        ]
    )


def _grid(positions: Array, others: Array) -> Sequence[float]:
    """Step, travel and width of the stops of the positions (m,) of an axis, those of ``others`` (m, k) being so."""
    order = np.argsort(positions, kind="stable")
    stop = np.zeros(len(positions), dtype=np.int64)
    stop[order] = np.concatenate([[0], np.cumsum(np.diff(positions[order]) > SAME_STOP_MM)])
    stops = stop.max() + 1
    deviations, beside = _within(positions[:, None], stop), _within(others, stop)
    unsaid = (deviations - beside @ np.linalg.lstsq(beside, deviations, rcond=None)[0])[:, 0]
    nowhere = (np.nan, np.nan, np.nan)
    if max(np.ptp(unsaid[stop == each]) for each in range(stops)) > TOLERANCE_MM:
        return nowhere
    width = max(float(np.ptp(deviations[stop == each])) for each in range(stops))
    if stops == 1:
        return 1.0, 0.0, width
    means = np.array([positions[stop == each].mean() for each in range(stops)])
    multiples = np.diff(means) / np.diff(means).min()
    if np.any(np.abs(multiples - np.round(multiples)) >= SAME_STEP):
        return nowhere
    travel = float(means[-1] - means[0])
    return travel / float(np.sum(np.round(multiples))), travel, width


def _within(columns: Array, stop: npt.NDArray[np.int64]) -> Array:
    """Columns (m, k) less their means over each stop."""
    count = np.bincount(stop)
    return (
        np.stack([column - (np.bincount(stop, weights=column) / count)[stop] for column in columns.T], axis=1)
        if columns.size
        else columns
    )
