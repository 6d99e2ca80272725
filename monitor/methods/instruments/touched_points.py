"""Points of a plate that the axes were brought to: what is read of the axes there holds the noise of the row.

A CMM touches a ball, whose place is stated, and its axes are read where they stopped. A tracker looks at an axis that
stands where it was told to go: what is read of it holds no noise, and what the fit leaves there holds what is hidden.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from monitor.effects import Context
from monitor.methods.chain.measured import Stopping
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.readings.point import Point
from monitor.records import Array

#: Of the rows of a plate that is touched again at least so many stand at a place that is already there. Below it a row
#: may have been copied, or an instrument have told its last point again. Places that nobody touched twice show nothing.
TOUCHED_AGAIN = 0.2
#: Stated places lie farther apart than so many standard uncertainties of a reading. Points that were measured again lie
#: nearer, and where the display is coarse many of them are equal.
NEAR = 5.0


def brought_to_points(context: Context, parts: Sequence[Part]) -> Stopping:
    """Return the linear joints, and the rows (n,) of setups whose known point of the tool they brought to places.

    A stated place recurs to the last digit from pass to pass, and the axes stop elsewhere each time. What is measured
    does not recur, whether the axes that were told where to go do or not.
    """
    joints = tuple(index for index, joint in enumerate(context.chain.joints) if not joint.turns)
    brought = np.zeros(len(context), dtype=bool)
    places = np.zeros((len(context), 1 + 3))
    for number, part in enumerate(parts):
        if joints and isinstance(part.reading, Point) and part.reading.holds("targets"):
            u = part.reading.setup.standard_uncertainty or 0.0
            brought[part.at] = _are_touched(part, context.positions[part.at], u)
            read = _read(part)
            places[part.at, 0] = number
            places[part.at, 1 : 1 + read.shape[1]] = read
    return Stopping(joints, brought, places)


def _are_touched(part: Part, stands: Array, u: float) -> bool:
    """Whether the axes, which stand at (m, J), were brought to the points of a setup, a reading of which has ``u``."""
    points = np.column_stack([np.unique(part.rows.target, return_inverse=True)[1], _read(part)])
    places = np.unique(points, axis=0)
    again = len(np.unique(np.column_stack([points, stands]), axis=0)) - len(places)
    if again < TOUCHED_AGAIN * len(points):
        return False
    # Of a single place the next is infinitely far.
    to_next = scipy.spatial.cKDTree(places).query(places, k=2)[0][:, 1]
    return bool(np.median(to_next) > NEAR * u)


def _read(part: Part) -> Array:
    """The points (m, k) of a setup, 0 where no number stands."""
    return np.nan_to_num(part.rows.measured)
