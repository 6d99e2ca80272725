"""Targets of a piece that are off alike in all of its places: what is off then belongs to the piece.

A plate that is touched in several places under one machine has a frame of its own in each of them, in which its targets
are stated. A hole that stands elsewhere than stated is off there by one vector, whichever axes moved to it and wherever
these stood. Errors of the machine go with its axes: seen from the piece they are others in every place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy import special

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.suspects.anomalies import BadPoint
from monitor.discovery.machine.suspects.off_alike import LEAST_TIMES, UPPER
from monitor.discovery.machine.suspects.recurring import PART_ALIKE
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.methods.instruments.readings.point import Point
from monitor.records import Array

# Fewer targets do not say what is usual.
FEWEST_TARGETS = 9
# More targets than this part that are off are no mistakes of single ones: nobody measured where the piece has them.
FEW = 0.1
# Where an axis stood in all places within this part of its travel, what it does there is the same in all of them.
APART = 0.05
# What is stated in all places recurs to the last digit.
SAME_STATED_MM = 1e-6


@dataclass(frozen=True)
class TargetOff:
    """A target that in all ``places`` and ``runs``, so many of each, is ``off`` (3,) mm from where it is stated, in the
    frame of its piece; ``point`` is that for a search, which leaves all ``point.rows`` out."""

    target: str
    off: tuple[float, float, float]
    places: int
    runs: int
    point: BadPoint

    @property
    def size(self) -> float:
        """By how much in mm it is off."""
        return float(np.linalg.norm(self.off))

    def measured_under(self, fit: Fit) -> TargetOff:
        """The same target with what it is off under a fit without its readings, which they do not pull."""
        x, y, z = _mean(fit, np.array(self.point.rows)).tolist()
        return replace(self, off=(x, y, z))


def off_in_all_places(fit: Fit, *, alpha: float = 0.01) -> tuple[TargetOff, ...]:
    """The targets of a piece with stated places that are off by the same vector in all of its places, two at least, and
    in all runs, at a false-alarm probability ``alpha`` a campaign; none where one axis stood alike in all of them."""
    rows, setup = _on_the_piece(fit)
    problem = fit.problem
    target, run = problem.context.target[rows], problem.context.run[rows]
    names, number = np.unique(target, return_inverse=True)
    if len(names) < FEWEST_TARGETS:
        return ()
    off = fit.vectors[rows]
    read = np.isfinite(problem.sigma[rows]).any(axis=0)
    means = np.array([off[number == each].mean(axis=0) for each in range(len(names))])
    squares = np.sum(means[:, read] ** 2, axis=1)
    targets = []
    for each in np.argsort(-squares, kind="stable").tolist():
        times = squares[each] / _usual(np.delete(squares, each), int(read.sum()))
        p_value = float(special.chdtrc(int(read.sum()), times)) * len(names)
        if times <= LEAST_TIMES**2 or p_value > alpha:
            break
        touches = number == each
        groups = (setup[touches], run[touches])
        places, runs = (len(np.unique(group)) for group in groups)
        is_alike = all(_are_alike(off[touches][:, read], group) for group in groups)
        if is_alike and places > 1 and _is_elsewhere(fit, rows, rows[touches], setup, setup[touches]):
            point = _point(fit, rows[touches], means[each], (p_value, float(times)))
            x, y, z = _mean(fit, rows[touches]).tolist()
            targets.append(TargetOff(str(names[each]), (x, y, z), places, runs, point))
    return tuple(targets) if len(targets) <= max(1, int(FEW * len(names))) else ()


def _on_the_piece(fit: Fit) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """The rows (m,) of targets that setups state at the same places in their own frames, and the setup of each."""
    problem = fit.problem
    nothing = np.zeros(0, dtype=np.int64)
    if not isinstance(problem, InstrumentProblem):
        return nothing, nothing
    parts = [part for part in problem.parts if _states_targets(part)]
    if len(parts) < 2:
        return nothing, nothing
    rows = np.concatenate([part.at for part in parts])
    stated = np.zeros((len(rows), 3))
    first = 0
    for part in parts:
        measured = part.rows.measured
        stated[first : first + len(measured), : measured.shape[1]] = measured
        first += len(measured)
    setup = np.repeat(np.arange(len(parts)), [len(part.at) for part in parts])
    of_target = np.unique(problem.context.target[rows], return_inverse=True)[1]
    is_read = fit.left_out[rows] | np.isfinite(problem.sigma[rows]).any(axis=1)
    for number in range(of_target.max() + 1):
        touches = of_target == number
        if not np.ptp(stated[touches], axis=0).max() <= SAME_STATED_MM:
            is_read &= ~touches
    return rows[is_read], setup[is_read]


def _mean(fit: Fit, rows: npt.NDArray[np.int64]) -> Array:
    """The mean (3,) mm of what rows are off, 0 along what they do not read."""
    mean = np.nan_to_num(fit.vectors[rows].mean(axis=0))[:3]
    return np.pad(mean, (0, 3 - len(mean)))


def _states_targets(part: Part) -> bool:
    """Whether a setup has points of stated targets in a frame that is not known."""
    reading = part.reading
    return isinstance(reading, Point) and reading.holds("targets") and not reading.holds("frame")


def _usual(squares: Array, numbers: int) -> float:
    """The usual variance of a number, by the squares (m,) of vectors of so many numbers of other targets."""
    median = np.median(squares) / special.chdtri(numbers, 0.5)
    upper = np.quantile(squares, UPPER) / special.chdtri(numbers, 1.0 - UPPER)
    return float(max(median, upper, 1e-300))


def _are_alike(off: Array, group: npt.NDArray[np.int64]) -> bool:
    """Whether vectors (m, d) have means nearly alike in all groups (m,)."""
    means = np.array([off[group == each].mean(axis=0) for each in np.unique(group)])
    middle = means.mean(axis=0)
    apart = np.linalg.norm(means - middle, axis=1).max()
    return bool(apart < PART_ALIKE * np.linalg.norm(middle))


def _is_elsewhere(
    fit: Fit,
    rows: npt.NDArray[np.int64],
    of_target: npt.NDArray[np.int64],
    setup: npt.NDArray[np.int64],
    setup_of_target: npt.NDArray[np.int64],
) -> bool:
    """Whether each axis that moves from target to target stood elsewhere at the rows ``of_target`` in one place
    than in another."""
    positions = fit.problem.context.positions
    travel = np.max([np.ptp(positions[rows[setup == each]], axis=0) for each in np.unique(setup)], axis=0)
    stood = np.array(
        [positions[of_target[setup_of_target == each]].mean(axis=0) for each in np.unique(setup_of_target)]
    )
    moves = travel > APART * max(float(travel.max()), 1e-9)
    return bool((np.ptp(stood, axis=0) > APART * travel)[moves].all())


def _point(fit: Fit, rows: npt.NDArray[np.int64], off: Array, said: tuple[float, float]) -> BadPoint:
    """All rows of a target as one that is left out."""
    context, row = fit.problem.context, int(rows[0])
    p_value, chi_square = said
    axis = int(np.argmax(np.nan_to_num(np.abs(off))))
    return BadPoint(
        row=row,
        run=int(context.run[row]),
        sequence=int(context.sequence[row]),
        target=str(context.target[row]),
        axis="xyz"[axis],
        size=float(off[axis]),
        p_value=min(1.0, p_value),
        chi_square=chi_square,
        rows=tuple(rows.tolist()),
    )
