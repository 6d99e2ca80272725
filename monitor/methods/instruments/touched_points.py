"""Points of a plate that the axes were brought to: what is read of the axes there holds the noise of the row.

A CMM touches a ball, whose place is stated, and its axes are read where they stopped. A tracker looks at an axis that
stands where it was told to go: what is read of it holds no noise, and what the fit leaves there holds what is hidden.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from monitor.effects import Context
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.readings.point import Point
from monitor.records import Array

#: Of the rows of a plate that is touched again at least so many stand at a place that is already there. Below it a row
#: may have been copied, or an instrument have told its last point again. Places that nobody touched twice show nothing.
TOUCHED_AGAIN = 0.2


def brought_to_points(
    context: Context, parts: Sequence[Part]
) -> tuple[tuple[int, ...], npt.NDArray[np.bool_]]:
    """Return the linear joints, and the rows (n,) of setups whose known point of the tool they brought to places.

    A stated place recurs to the last digit from pass to pass, and the axes stop elsewhere each time. What is measured
    does not recur, whether the axes that were told where to go do or not.
    """
    joints = tuple(index for index, joint in enumerate(context.chain.joints) if not joint.turns)
    brought = np.zeros(len(context), dtype=bool)
    for part in parts:
        if joints and isinstance(part.reading, Point) and part.reading.holds("targets"):
            points = np.column_stack([np.unique(part.rows.target, return_inverse=True)[1], _read(part)])
            stands = len(np.unique(np.column_stack([points, context.positions[part.at]]), axis=0))
            brought[part.at] = stands - len(np.unique(points, axis=0)) >= TOUCHED_AGAIN * len(part.at)
    return joints, brought


def stated_places(context: Context, parts: Sequence[Part]) -> Array:
    """Return the points (n, 4) that rows of points state, in mm, behind the number of their setup; else zeros."""
    places = np.zeros((len(context), 4))
    for number, part in enumerate(parts, start=1):
        if isinstance(part.reading, Point):
            read = _read(part)
            places[part.at, 0] = number
            places[part.at, 1 : 1 + read.shape[1]] = read
    return places


def _read(part: Part) -> Array:
    """The points (m, k) of a setup, 0 where no number stands."""
    return np.nan_to_num(part.rows.measured)
