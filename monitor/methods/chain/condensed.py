"""Very many rows as few: what a fit asks of the rows of a run is kept by a triangle.

An orthogonal transformation of the rows of a run changes no sum of squares, no projection and no rank. So the triangle
of the QR decomposition of a run's derivatives and residuals, one row more than it has unknowns, gives the fit that all
its rows give, to rounding. It is of_runs of some rows at a time, each time with the triangle before (sequential TSQR:
J. Demmel et al., SIAM J. Sci. Comput. 34 (2012) A206), so that derivatives are held of these alone.

Use this where only the least-squares point is asked for. What looks at single rows of a linearisation needs all of it.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.stopping import checkpoint


def triangles(blocks: Iterable[tuple[npt.NDArray[np.int64], Array]], runs: int, width: int) -> Array:
    """The triangles (R, w, w) of all rows, which come in blocks: places (m,) of their runs, numbers (m, d, w)."""
    of_runs = np.zeros((runs, width, width))
    for places, rows in blocks:
        checkpoint()
        for run in np.unique(places):
            of_run = rows[places == run].reshape(-1, width)
            of_runs[run] = np.linalg.qr(np.concatenate([of_runs[run], of_run]), mode="r")
    return of_runs
