"""Targets that are off alike in every run: a hole of all parts, or its stated place.

Each run of a part, a plate or a tracker lies in a frame of its own, so that one deviation of the part stands along
other directions of the instrument in every run. Turned back into the frame of an axis, the mean over the runs is judged
against those of the other places of the plan, for no comparison of the runs shows what they share.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import special

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.noise.plan_cells import plan_cells
from monitor.discovery.machine.suspects.anomalies import BadPoint
from monitor.discovery.machine.suspects.recurring import PART_ALIKE
from monitor.machine import MOTION
from monitor.records import Array

# Smooth errors that the model lacks give the means of many places long tails; a target that is off stands so many times
# beyond the usual deviation, which is the larger one of those of the median and of this quantile.
LEAST_TIMES, UPPER = 6.0, 0.95
# More places than this part that are off are a shape of the machine.
FEW = 0.05
# Fewer places do not say what is usual.
FEWEST_PLACES = 20
# What turns by less than this part moves nothing along any direction.
ORTHONORMAL = 1e-2


def off_alike(fit: Fit, *, alpha: float = 0.01) -> tuple[BadPoint, ...]:
    """The readings of places that all runs, two at least, found off by the same vector, one point for each direction of
    the axes' frame in which it stands out, at a false-alarm probability ``alpha`` a campaign; ``size`` is what was read
    less what the model says. Of instruments that read no axis."""
    problem = fit.problem
    runs = len(problem.runs)
    if problem.measured_joints or runs < 2:
        return ()
    rows, off = _in_frame_of_axes(fit)
    cells = plan_cells(problem)[rows]
    in_all = np.bincount(cells, minlength=1) == runs
    places = np.flatnonzero(in_all)
    if len(places) < FEWEST_PLACES:
        return ()
    members = np.array([np.flatnonzero(cells == cell) for cell in places])
    means = off[members].mean(axis=1)
    numbers = fit.vectors.shape[1]
    squares = _scaled(np.sum(means**2, axis=1), numbers)
    p_values = special.chdtrc(numbers, squares) * len(places)
    stands = np.flatnonzero((p_values <= alpha) & (squares > LEAST_TIMES**2))
    apart = np.linalg.norm(off[members] - means[:, None], axis=2).max(axis=1)
    alike = [at for at in stands if apart[at] < PART_ALIKE * np.linalg.norm(means[at])]
    if len(alike) > max(1, int(FEW * len(places))):
        return ()
    return tuple(
        _point(fit, int(rows[row]), letter, float(off[row, axis]), (float(p_values[at]), float(squares[at])))
        for at in alike
        for row in members[at]
        for axis, letter in enumerate("xyz")
        if abs(means[at, axis]) > PART_ALIKE * np.abs(means[at]).max()
    )


def _in_frame_of_axes(fit: Fit) -> tuple[npt.NDArray[np.int64], Array]:
    """The rows (m,) that show a shift of the tip, along whichever directions, and what was read there less what the
    model says (m, 3), in mm along the axes' directions."""
    joint = len(fit.problem.context.chain.joints) - 1
    into = fit.observed_by_error[:, :, joint, MOTION, :3]
    gram = into @ np.swapaxes(into, 1, 2)
    is_read = np.isfinite(fit.vectors).all(axis=1) & (
        fit.left_out | np.isfinite(fit.problem.sigma).all(axis=1)
    )
    rows = np.flatnonzero(is_read & (np.abs(gram - np.eye(into.shape[1])).max(axis=(1, 2)) < ORTHONORMAL))
    # The last joint carries the tool where one does; one of the work moves the tip the other way.
    side = 1.0 if fit.problem.context.chain.tool else -1.0
    return rows, -side * np.einsum("nda,nd->na", into[rows], fit.vectors[rows])


def _scaled(squares: Array, numbers: int) -> Array:
    """Squares (m,) of vectors of so many numbers, scaled so that most of them are as chi-square says."""
    median = np.median(squares) / special.chdtri(numbers, 0.5)
    upper = np.quantile(squares, UPPER) / special.chdtri(numbers, 1.0 - UPPER)
    return np.asarray(squares / max(median, upper, 1e-300))


def _point(fit: Fit, row: int, axis: str, size: float, said: tuple[float, float]) -> BadPoint:
    context = fit.problem.context
    p_value, chi_square = said
    return BadPoint(
        row=row,
        run=int(context.run[row]),
        sequence=int(context.sequence[row]),
        target=str(context.target[row]),
        axis=axis,
        size=size,
        p_value=min(1.0, p_value),
        chi_square=chi_square,
        frame=context.chain.joints[-1].name,
    )
