"""Points of a plate that the axes were brought to: what is read of the axes there holds the noise of the row.

A CMM touches a ball, whose place is stated, and its axes are read where they stopped. A tracker looks at an axis that
stands where it was told to go: what is read of it holds no noise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from monitor.effects import Context
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.readings.point import Point


def brought_to_points(
    context: Context, parts: Sequence[Part]
) -> tuple[tuple[int, ...], npt.NDArray[np.bool_]]:
    """Return the linear joints, and the rows (n,) of setups whose known point of the tool they brought to places.

    An axis that is told where to go stands at some positions twice, to the last digit; one that stops where a ball is
    does not.
    """
    joints = tuple(index for index, joint in enumerate(context.chain.joints) if not joint.turns)
    brought = np.zeros(len(context), dtype=bool)
    for part in parts:
        if joints and isinstance(part.reading, Point) and part.reading.holds("targets"):
            stood = context.positions[part.at]
            brought[part.at] = len(np.unique(stood, axis=0)) == len(stood)
    return joints, brought
