"""Where the axes bring the tool by the machine file: the workflow, which knows the chain, passes it to the doubts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from monitor.records import Array

#: Gives of rows (m,) the frames (m, 3, 4) of the tool as a machine without errors has them, seen from the work side:
#: the point t of the tool stands at frame @ (t, 1), in mm.
ToolFrames = Callable[[npt.NDArray[np.int64]], Array]


def apart(frames: Array) -> float:
    """Return by how many mm one point of the tool is moved at least in frames (m, 3, 4), wherever on the tool it is.

    Where it is, few files say to a millimetre: a head turns about a tip whose length is an unknown.
    """
    turned, shifted = frames[:, :, :3], frames[:, :, 3]
    by_place = (turned - turned.mean(axis=0)).reshape(-1, 3)
    moved = (shifted - shifted.mean(axis=0)).reshape(-1)
    on_tool = np.linalg.lstsq(by_place, -moved, rcond=1e-9)[0]
    return float(np.ptp((moved + by_place @ on_tool).reshape(-1, 3), axis=0).max())
