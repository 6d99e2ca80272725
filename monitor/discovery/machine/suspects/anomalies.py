"""Bad single points and balls that came loose: reported as what they are, not as a law of physics.

Both are seen as a deviation of one run from the others at the same row of the plan, so an effect that the
model lacks in every run does not raise an alarm. A point is bad where the vector of its own deviation is too
long; a ball has moved where all its later touches in that run are shifted by the same vector.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.noise.plan_cells import plan_cells
from monitor.discovery.machine.suspects.tails import Shifts, tails_of
from monitor.methods.chain.gross import off_reading
from monitor.methods.chain.least_squares import eliminate
from monitor.records import Array

# A ball that moved needs this many touches before and after, else it is a bad point.
TOUCHES_EACH_SIDE = 2
# Following touches of one target, within which neighbours may resemble each other.
LAGS = 8
# Directions that a touch leaves unchecked (the run's own unknowns follow it) have eigenvalues of rounding.
CHECKED = 1e-6


@dataclass(frozen=True)
class BadPoint:
    """A probing that contradicts the same one of the other runs; ``size`` mm along the machine's ``axis``. ``rows`` are
    those of a pose that is bad as a whole; ``turn`` rad is by how much a body of six numbers is turned, whose place is
    off by ``size``; ``frame`` names the axis in whose frame ``axis`` is, where that is not the frame of the reading."""

    row: int
    run: int
    sequence: int
    target: str
    axis: str
    size: float
    p_value: float
    chi_square: float = 0.0
    rows: tuple[int, ...] = ()
    turn: float | None = None
    frame: str | None = None

    @property
    def all_rows(self) -> tuple[int, ...]:
        """The rows that are left out with it."""
        return self.rows or (self.row,)


@dataclass(frozen=True)
class BallMove:
    """A ball, or the whole piece where it is ``of_all``, that stands elsewhere from a probing on; ``shift`` (3,) mm in
    the frame of the last work axis."""

    target: str
    run: int
    sequence: int
    shift: tuple[float, float, float]
    p_value: float
    chi_square: float = 0.0
    of_all: bool = False

    @property
    def size(self) -> float:
        """Length of the shift in mm."""
        return float(np.linalg.norm(self.shift))

    @property
    def text(self) -> str:
        """The move as an effect."""
        what = "artefact" if self.of_all else f"ball:{self.target}"
        return f"{what}:moved(run {self.run}, sequence {self.sequence})"


@dataclass(frozen=True)
class Deviations:
    """Deviation (n, d) of every probing from the other runs', in standard uncertainties, and its spread."""

    vectors: Array
    inflation: Array  # (n,): variance of a deviation over that of a residual
    rows: tuple[npt.NDArray[np.int64], ...]  # rows of every run
    bases: Array  # (R, N, p)
    parts: Array  # (n, d, d): what of a row's own deviation the run's unknowns leave
    scale: Array  # (n,): standard deviation of a coordinate in standard uncertainties

    def of_run(self, run: int) -> Array:
        """The span of the unknowns of a run, row by row (m, d, p)."""
        rows, numbers = len(self.rows[run]), self.vectors.shape[1]
        return self.bases[run, : numbers * rows].reshape(rows, numbers, -1)


def deviations_of(fit: Fit) -> Deviations:
    """The deviations of a fit; of a campaign of one or two runs its residuals."""
    problem = fit.problem
    white = np.where(fit.left_out[:, None], 0.0, fit.vectors / fit.problem.sigma)
    cells = plan_cells(problem)
    weighted = ~fit.left_out
    count = np.bincount(cells, weights=weighted)
    total = np.stack([np.bincount(cells, weights=white[:, axis]) for axis in range(white.shape[1])], axis=1)
    others = count[cells] - 1
    enough = weighted & (others >= 2)
    mean = (total[cells] - white) / np.where(enough, others, 1)[:, None]
    vectors = np.where(enough[:, None], white - mean, white)
    inflation = np.where(enough, 1.0 + 1.0 / np.where(enough, others, 1), 1.0)
    rows = tuple(np.flatnonzero(problem.context.run == run) for run in problem.runs)
    bases = eliminate(fit.solution.last.local).basis
    parts = checked_parts(fit, bases)
    # A few bad points must not hide themselves: the scale is taken from the median. A run that is noisier than
    # the others as a whole has no bad points for that.
    # Rows of several instruments differ in how many numbers they have.
    usual = 2.0 * scipy.special.gammaincinv(np.maximum(np.isfinite(problem.sigma).sum(axis=1), 1) / 2.0, 0.5)
    squares = np.sum(vectors**2, axis=1) / inflation / usual
    share = max(fit.degrees_of_freedom / (fit.readings + 1e-300), 1e-6)
    scale = np.full(len(weighted), np.median(squares[weighted]) / share)
    for members in rows:
        if weighted[members].any():
            of_run = np.median(squares[members][weighted[members]]) / share
            scale[members] = np.maximum(scale[members], of_run)
    scale = np.sqrt(scale)
    return Deviations(vectors, inflation, rows, bases, parts, scale)


def checked_parts(fit: Fit, bases: Array | None = None) -> Array:
    """What every run's own unknowns leave (n, d, d) of the variance of each row's own residual; ``bases`` (R, N, p)
    are their span where it is known."""
    problem = fit.problem
    is_read = np.isfinite(problem.sigma)
    rows, numbers = is_read.shape
    parts = np.zeros((rows, numbers, numbers))
    bases = eliminate(fit.solution.last.local).basis if bases is None else bases
    for number, run in enumerate(problem.runs):
        members = np.flatnonzero(problem.context.run == run)
        basis = bases[number, : numbers * len(members)].reshape(len(members), numbers, -1)
        parts[members] = np.eye(numbers) - basis @ np.swapaxes(basis, 1, 2)
    return np.asarray(parts * is_read[:, :, None] * is_read[:, None, :])


def statistic(onto: Array, gram: Array) -> tuple[Array, npt.NDArray[np.int64], Array]:
    """Explained squares (n,), ranks (n,) and coefficients (n, d) of columns with products ``onto`` (n, d) and
    ``gram`` (n, d, d)."""
    values, vectors = np.linalg.eigh(gram)
    keep = values > CHECKED
    along = np.einsum("nij,ni->nj", vectors, onto) * keep
    inverse = np.where(keep, 1.0 / np.where(keep, values, 1.0), 0.0)
    return (
        np.sum(along**2 * inverse, axis=1),
        keep.sum(axis=1),
        np.einsum("nij,nj->ni", vectors, along * inverse),
    )


def bad_points(fit: Fit, *, alpha: float = 0.01, deviations: Deviations | None = None) -> list[BadPoint]:
    """The worst point of every run that is too far off, at a false-alarm probability ``alpha`` a campaign;
    ``deviations`` are those of the fit where they are known."""
    deviations = deviations or deviations_of(fit)
    context = fit.problem.context
    tests = int((~fit.left_out).sum())
    points = []
    for rows in deviations.rows:
        square, rank, sizes = statistic(deviations.vectors[rows], deviations.parts[rows])
        checked = (rank > 0) & ~fit.left_out[rows]
        if not checked.any():
            continue
        # The worst by its chi-square: p-values of wrecks underflow and would tie.
        chi_square = np.where(
            checked, square / deviations.inflation[rows] / deviations.scale[rows] ** 2, -1.0
        )
        worst = int(chi_square.argmax())
        p = float(scipy.special.chdtrc(rank[worst], chi_square[worst]))
        row, size = int(rows[worst]), sizes[worst]
        if p * tests <= alpha:
            # A number that was not read has no weight, and its size is rounding.
            sigma = fit.problem.sigma[row]
            axis, off = off_reading(
                fit.problem, fit.by_error, row, size * np.where(np.isfinite(sigma), sigma, 0.0)
            )
            points.append(
                BadPoint(
                    row=row,
                    run=int(context.run[row]),
                    sequence=int(context.sequence[row]),
                    target=str(context.target[row]),
                    axis=axis,
                    size=off,
                    p_value=min(1.0, p * tests),
                    chi_square=float(chi_square[worst]),
                )
            )
    return points


def ball_moves(fit: Fit, *, alpha: float = 0.01, deviations: Deviations | None = None) -> list[BallMove]:
    """For every run the ball that moved in it, if any, at a false-alarm probability ``alpha`` a campaign;
    ``deviations`` are those of the fit where they are known."""
    deviations = deviations or deviations_of(fit)
    context = fit.problem.context
    weighted = ~fit.left_out
    tails = tails_of((deviations.vectors / np.sqrt(deviations.inflation)[:, None])[weighted])
    moves = []
    tests = 0
    for run, rows in enumerate(deviations.rows):
        best: BallMove | None = None
        vectors = deviations.vectors[rows] / np.sqrt(deviations.inflation[rows])[:, None]
        judged = ~fit.left_out[rows]
        under_tails = Shifts(tails, vectors[judged], deviations.of_run(run)[judged])
        for target in np.intersect1d(context.target[rows], fit.problem.movable):
            touches = np.flatnonzero((context.target[rows] == target) & ~fit.left_out[rows])
            tests += max(len(touches) - 2 * TOUCHES_EACH_SIDE + 1, 0)
            move = _ball_move(fit, deviations, under_tails, run, touches)
            if move is not None:
                # Where the others drift as well, a mean of touches knows less than their number says.
                share = _shared_by_neighbours(deviations.vectors[rows], context.target[rows], str(target))
                chi_square = move.chi_square / share
                p_value = float(scipy.special.chdtrc(3, chi_square)) if share > 1.0 else move.p_value
                move = replace(move, chi_square=chi_square, p_value=max(p_value, move.p_value))
            if move is not None and (best is None or move.chi_square > best.chi_square):
                best = move
        if best is not None:
            moves.append(best)
    return [
        replace(move, p_value=min(1.0, move.p_value * tests))
        for move in moves
        if move.p_value * tests <= alpha
    ]


def _shared_by_neighbours(vectors: Array, targets: npt.NDArray[np.str_], suspect: str) -> float:
    """By how much the variance of a mean of touches exceeds that of independent ones, by the deviations (n, d) of all
    targets of a run but the suspect: one and twice the correlations of the following touches of the same target, up to
    the first that no longer goes along."""
    series = [vectors[targets == target] for target in np.unique(targets) if target != suspect]
    total = sum(float(np.sum(of_target**2)) for of_target in series)
    share = 1.0
    for lag in range(1, LAGS):
        later = sum(float(np.sum(of_target[lag:] * of_target[:-lag])) for of_target in series)
        if total <= 0.0 or later <= 0.0:
            break
        share += 2.0 * later / total
    return share


def _ball_move(
    fit: Fit, deviations: Deviations, under_tails: Shifts, run: int, touches: npt.NDArray[np.int64]
) -> BallMove | None:
    """The likeliest move of the ball that is touched in these rows of a run; its p-value is that of one test, and no
    smaller than its likelihood under the tails of all touches allows."""
    context, rows, basis = fit.problem.context, deviations.rows[run], deviations.of_run(run)
    first = np.arange(TOUCHES_EACH_SIDE, len(touches) - TOUCHES_EACH_SIDE + 1)
    if len(first) == 0:
        return None
    # Sums over all touches from each one on.
    shared = np.cumsum(basis[touches][::-1], axis=0)[::-1][first]
    onto = np.cumsum(deviations.vectors[rows[touches]][::-1], axis=0)[::-1][first]
    count = len(touches) - first
    gram = count[:, None, None] * np.eye(3) - shared @ np.swapaxes(shared, 1, 2)
    inflation = np.cumsum(deviations.inflation[rows[touches]][::-1])[::-1][first] / count
    square, rank, shifts = statistic(onto, gram)
    chi_square = np.where(rank > 0, square / inflation / deviations.scale[rows[0]] ** 2, -1.0)
    best = int(chi_square.argmax())
    if chi_square[best] <= 0:
        return None
    moved = -basis @ shared[best].T
    moved[touches[first[best] :]] += np.eye(3)
    likelihood = under_tails.likelihood(moved[~fit.left_out[rows]], shifts[best])
    chi_square[best] = min(float(chi_square[best]), max(likelihood, 0.0))
    row = int(rows[touches[first[best]]])
    # The tip followed the ball, so the vector from where the ball was to the tip is its shift.
    x, y, z = (float(part) for part in shifts[best] * fit.problem.sigma[row])
    return BallMove(
        target=str(context.target[row]),
        run=int(context.run[row]),
        sequence=int(context.sequence[row]),
        shift=(x, y, z),
        p_value=float(scipy.special.chdtrc(rank[best], chi_square[best])),
        chi_square=float(chi_square[best]),
    )
