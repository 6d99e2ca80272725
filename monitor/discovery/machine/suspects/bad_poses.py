"""Bad poses and bad readings of a robot: several reflectors are seen at each pose, and no pose is repeated.

What all reflectors of a pose share is one deviation, what one of them does alone another. Both are judged against the
usual size of their kind, so that joints that come to rest anew at each pose, or a noisy tracker, make nothing bad; all
that stand out are marked at once.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import special

from monitor.discovery.machine.evidence.held_out import poses_of
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.suspects.anomalies import BadPoint
from monitor.records import Array

# The scale is the larger of those of the median and of this quantile: deviations grow with the reach of a pose, so
# that they have longer tails than one Gaussian.
UPPER = 0.95
# The p-value of a rest that is not Gaussian is larger than it looks; a bad reading is off by more than this many times
# the usual deviation in any case.
LEAST_TIMES = 6.0
# Whole poses end with their turns, which stand beside lengths as what they come to at one metre, in mm.
TURNS, LEVER = ("a", "b", "c"), 1000.0


def _chi_squares(squares: Array, numbers: int) -> Array:
    """Squares (m,) of vectors of so many numbers, scaled so that most of them are as chi-square says."""
    median = np.median(squares) / special.chdtri(numbers, 0.5)
    upper = np.quantile(squares, UPPER) / special.chdtri(numbers, 1.0 - UPPER)
    return np.asarray(squares / max(median, upper, 1e-300))


def _outstanding(chi_square: Array, numbers: int, alpha: float) -> npt.NDArray[np.int64]:
    """Indices of those that noise makes with a probability below ``alpha`` in all, the worst first."""
    p_values = special.chdtrc(numbers, chi_square) * len(chi_square)
    worst = np.argsort(-chi_square)
    marked = (p_values[worst] <= alpha) & (chi_square[worst] > LEAST_TIMES**2)
    return np.asarray(worst[marked])


def bad_poses(fit: Fit, *, alpha: float = 0.01) -> list[BadPoint]:
    """The poses and single readings that are too far off, at a false-alarm probability ``alpha`` each; those that have
    no weight are judged with the others."""
    context, problem = fit.problem.context, fit.problem
    rows = np.flatnonzero(~np.isin(context.target, list(problem.resting)))
    white = fit.vectors[rows] / np.where(np.isfinite(problem.sigma[rows]), problem.sigma[rows], fit.sigma)
    numbers = white.shape[1]
    _, pose = np.unique(poses_of(fit)[rows], return_inverse=True)
    count = np.bincount(pose)
    mean = np.column_stack([np.bincount(pose, weights=column) for column in white.T]) / count[:, None]
    points: list[BadPoint] = []
    # The mean of a pose with few reflectors scatters no more than its shared part does.
    shared = _chi_squares(np.sum(mean**2, axis=1), numbers)
    several = count[pose] > 1
    alone = (white - mean[pose])[several]
    share = (1.0 - 1.0 / count[pose])[several]
    single = _chi_squares(np.sum(alone**2, axis=1) / share, numbers) if several.any() else np.zeros(0)
    for index in _outstanding(single, numbers, alpha):
        row = int(rows[several][index])
        points.append(_point(fit, [row], alone[index], float(single[index]), numbers, len(single)))
    wrong = {row for point in points for row in point.rows}
    for index in _outstanding(shared, numbers, alpha):
        members = [int(row) for row in rows[pose == index]]
        if not wrong.intersection(members):
            points.append(_point(fit, members, mean[index], float(shared[index]), numbers, len(shared)))
    return points


def _point(fit: Fit, rows: list[int], white: Array, chi_square: float, numbers: int, tests: int) -> BadPoint:
    context, first = fit.problem.context, rows[0]
    targets = ", ".join(dict.fromkeys(str(context.target[row]) for row in rows))
    p_value = float(special.chdtrc(numbers, chi_square)) * tests
    size, turn = float(np.linalg.norm(white)) * fit.sigma, None
    if fit.problem.components[-3:] == TURNS:
        sigma = fit.problem.sigma[first]
        off = white * np.where(np.isfinite(sigma), sigma, fit.sigma)
        size, turn = float(np.linalg.norm(off[:-3])), float(np.linalg.norm(off[-3:])) / LEVER
    return BadPoint(
        row=first,
        run=int(context.run[first]),
        sequence=int(context.sequence[first]),
        target=targets,
        axis="the pose" if len(rows) > 1 else "its place",
        size=size,
        p_value=min(1.0, p_value),
        chi_square=chi_square,
        rows=tuple(rows),
        turn=turn,
    )
