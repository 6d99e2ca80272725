"""Least squares for many runs at once: unknowns of each run, unknowns common to all, rank and null space.

The runs share only the common unknowns, so every Gauss-Newton step takes each run's own columns out first
(QR, then a singular value decomposition of the small triangle) and solves for the common ones on what is
left. What the data cannot separate is detected by the rank, gets no step and no number, and is named.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from monitor.exceptions import NotConvergedError
from monitor.records import Array
from monitor.stopping import checkpoint

# Columns are scaled to unit length first. Unknowns that a plan separates leave singular values above 1e-3 on
# the plans tried; those that it cannot separate leave products of errors of second order, below 1e-6 for
# errors of 1 mrad and 1 mm. The limit stands between.
RANK_TOLERANCE = 1e-5
# Of a common unknown the same limit would keep directions that only products of errors of second order leave; they
# turn with every step, which then does not converge. What is left less than this part says nothing of the effect.
COMMON_RANK_TOLERANCE = 1e-3
# Steps are measured in standard deviations of the whitened residuals; a hundred-millionth is far below any
# digit that is printed.
STEP_TOLERANCE = 1e-8
# Where a stated uncertainty is a billionth of the readings, rounding alone is a larger step than that. Steps below a
# hundred-thousandth that have stopped shrinking are rounding.
ROUNDING = 1e-5
MOST_ITERATIONS = 50
# Where much is left and the model bends, whole steps of Gauss and Newton go past the point, each further than the last
# (Fletcher, Practical Methods of Optimization, 1987, 6.1). Steps above this size that raise the sum of squares by more
# than rounding are halved, and those after them begin so. Steps below a standard deviation that are less than half of
# the last one go nowhere else: there the sum may rise by what the derivatives leave out (products of errors), and
# halving would stop short of the point.
SMALLEST_HALVED, ROUNDING_OF_SUM = 1e-3, 1e-11
# Halved steps take a tenth off the rest where whole ones take a fifth.
DAMPED_TIMES = 4
MOST_HALVINGS, STALLED = 12, 1e-6
# A step of this part of the radius of a confidence region is none, where no more is left than this many times what
# is stated.
SETTLED, MOST_LEFT = 0.02, 10.0
# A member of a null vector is named where its share exceeds this part of the largest.
MEMBER_SHARE = 1e-3
# Gains have 0.7 of the null vectors of plans with one rotary axis (20 campaigns); of others they have what rounding
# leaves, by which nothing should be divided.
LEAST_SHARE = 1e-2


@dataclass(frozen=True)
class Linearisation:
    """Whitened residuals (R, N) of R runs, padded with zero rows, and their derivatives.

    ``local`` (R, N, p) by the unknowns of the run, ``common`` (R, N, c) by those of all runs.
    """

    residual: Array
    local: Array
    common: Array


@dataclass(frozen=True)
class Solution:
    """The least-squares point of R runs with p unknowns each and c common ones.

    ``local`` (R, p) and ``common`` (c,) with the covariances ``local_covariance`` (R, p, p) and
    ``common_covariance`` (c, c) for residuals of unit variance; ``local_free`` (R, p) and ``common_free`` (c,)
    say which unknowns the data determine; ``null_space`` (R, p, p) holds scaled null vectors in its rows,
    zero rows where there is none. ``rank`` (R,) counts what each run determines. ``common_held`` (c,) are held at zero,
    because others do the same; empty where none were looked for.
    """

    local: Array
    common: Array
    local_covariance: Array
    common_covariance: Array
    local_free: npt.NDArray[np.bool_]
    common_free: npt.NDArray[np.bool_]
    null_space: Array
    rank: npt.NDArray[np.int64]
    iterations: int
    last: Linearisation
    common_held: npt.NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))


@dataclass(frozen=True)
class _Elimination:
    """Each run's own columns, orthonormalised: ``basis`` (R, N, p), zero where there is no rank."""

    basis: Array
    inverse: Array  # (R, p, p): coefficients in the basis to unknowns
    null_space: Array
    rank: npt.NDArray[np.int64]
    scale: Array  # (R, p): the lengths of the columns

    def kept_small(
        self, local: Array, step: Array, held: npt.NDArray[np.bool_] | None
    ) -> tuple[Array, float]:
        """A step (R, p) from ``local`` (R, p) with what brings the unknowns ``held`` (p,) nearest to zero within the
        null space, each as large as what it moves, and how far that moves."""
        if held is None or np.abs(self.null_space[:, :, held]).max(initial=0.0) <= LEAST_SHARE:
            return step, 0.0
        u, s, vt = np.linalg.svd(self.null_space[:, :, held], full_matrices=False)
        takes_part = s > LEAST_SHARE
        inverse_s = np.where(takes_part, 1.0 / np.where(takes_part, s, 1.0), 0.0)
        weights = (u * inverse_s[:, None, :]) @ (vt @ ((local + step) * self.scale)[:, held, None])
        back = -np.einsum("rkp,rk->rp", self.null_space, weights[..., 0])
        return step + back / self.scale, float(np.linalg.norm(back))


def eliminate(local: Array) -> _Elimination:
    """Orthonormal basis of what each run's own unknowns can do, and its null space; rows may be fewer than unknowns."""
    rows, unknowns = local.shape[1:]
    scale = np.linalg.norm(local, axis=1)
    scale[scale == 0] = 1.0
    whole = local / scale[:, None, :]
    if rows < unknowns:
        # Rows of zeros say nothing: without them there would be fewer singular values than unknowns.
        whole = np.pad(whole, ((0, 0), (0, unknowns - rows), (0, 0)))
    q, triangle = np.linalg.qr(whole)
    u, s, vt = np.linalg.svd(triangle)
    keep = s > RANK_TOLERANCE * s.max(axis=-1, keepdims=True, initial=0.0)
    basis = (q @ u)[:, :rows] * keep[:, None, :]
    inverse_s = np.where(keep, 1.0 / np.where(keep, s, 1.0), 0.0)
    inverse = np.swapaxes(vt, -1, -2) * inverse_s[:, None, :] / scale[:, :, None]
    return _Elimination(basis, inverse, vt * ~keep[:, :, None], keep.sum(axis=-1), scale)


@dataclass(frozen=True)
class RunSpace:
    """What the unknowns of one run span: an orthonormal ``basis`` (N, p), zero where there is no rank, ``inverse``
    (p, p) from its coefficients to unknowns, and the ``rank``."""

    basis: Array
    inverse: Array
    rank: int


def space_of_run(columns: Array) -> RunSpace:
    """The span of the columns (N, p) of one run, as ``eliminate`` for decisions that no digit depends on."""
    scale = np.linalg.norm(columns, axis=0)
    if len(columns) >= columns.shape[1]:
        q, triangle = np.linalg.qr(columns / np.where(scale == 0.0, 1.0, scale))
        inverse = inverse_of_full_rank(triangle)
        if inverse is not None:
            return RunSpace(q, inverse / scale[:, None], columns.shape[1])
    space = eliminate(columns[None])
    return RunSpace(space.basis[0], space.inverse[0], int(space.rank[0]))


def inverse_of_full_rank(triangle: Array) -> Array | None:
    """The inverse of a triangle (p, p) whose columns have about unit length, None where it may lack rank.

    The norms of a triangle and its inverse bound its smallest singular value: ten times above the limit of the rank
    the decomposition into singular values, which takes ten times as long, could say nothing else.
    """
    with suppress(np.linalg.LinAlgError):
        inverse = np.linalg.inv(triangle)
        if np.linalg.norm(triangle) * np.linalg.norm(inverse) < 0.1 / RANK_TOLERANCE:
            return np.asarray(inverse)
    return None


def project_out(basis: Array, columns: Array) -> Array:
    """What is left of columns (R, N, k) once the span of ``basis`` (R, N, p) is taken out."""
    remainder: Array = columns - basis @ (np.swapaxes(basis, -1, -2) @ columns)
    return remainder


@dataclass(frozen=True)
class _CommonStep:
    """The step of the common unknowns (c,), their covariance (c, c), which of them the data determine (c,), and how
    many directions."""

    step: Array
    covariance: Array
    free: npt.NDArray[np.bool_]
    rank: int


def _common_step(remainder: Array, whole: Array, residual: Array) -> _CommonStep:
    """The step of the common unknowns from what is left of their derivatives, ``whole`` before, and the residual."""
    count = remainder.shape[-1]
    if count == 0:
        return _CommonStep(np.zeros(0), np.zeros((0, 0)), np.zeros(0, dtype=bool), 0)
    scale = np.linalg.norm(whole.reshape(-1, count), axis=0)
    scale[scale == 0] = 1.0
    matrix = remainder.reshape(-1, count) / scale
    # Singular values above 1e-3 have squares that products of columns hold to ten digits; each step corrects the last.
    squares, vectors = np.linalg.eigh(matrix.T @ matrix)
    keep = squares > COMMON_RANK_TOLERANCE**2
    inverse = vectors[:, keep] / np.sqrt(squares[keep]) / scale[:, None]
    free = np.abs(vectors[:, ~keep]).max(axis=1, initial=0.0) < MEMBER_SHARE
    gradient = (matrix.T @ residual.reshape(-1)) * scale
    return _CommonStep(-inverse @ (inverse.T @ gradient), inverse @ inverse.T, free, int(keep.sum()))


def solve(
    linearise: Callable[[Array, Array], Linearisation],
    local: Array,
    common: Array,
    most: int = MOST_ITERATIONS,
    squares: Callable[[Array, Array], float | None] = lambda *_: None,
    held: npt.NDArray[np.bool_] | None = None,
) -> Solution:
    """The least-squares point by Gauss-Newton, from the start ``local`` (R, p) and ``common`` (c,). ``squares`` gives
    the sum of squares without derivatives, None where these cost nothing to speak of. Of the points that no reading
    tells apart it is that with the unknowns ``held`` (p,) nearest to zero; else what a step needs least.

    Raises NotConvergedError if it does not converge in ``most`` steps, which means readings that contradict the machine
    file (a wrong sign, a wrong axis or a ball confused with another).
    """
    current = linearise(local, common)
    cost = float(np.sum(current.residual**2))
    space, spanned = eliminate(current.local), current.local
    before, damping, halved = np.inf, 1.0, False
    for iteration in range(1, DAMPED_TIMES * most + 1):
        if damping < STALLED or (iteration > most and damping == 1.0):
            break
        checkpoint()
        if current.local is not spanned:
            space, spanned = eliminate(current.local), current.local
        whole = np.concatenate([current.common, current.residual[..., None]], axis=-1)
        remainder = project_out(space.basis, whole)
        of_common = _common_step(remainder[..., :-1], current.common, remainder[..., -1])
        moved = current.residual + current.common @ of_common.step
        in_basis = -np.einsum("rnp,rn->rp", space.basis, moved)
        step_local = np.einsum("rkp,rp->rk", space.inverse, in_basis)
        size = float(np.sqrt(np.sum(in_basis**2) + np.sum((remainder[..., :-1] @ of_common.step) ** 2)))
        step_local, back = space.kept_small(local, step_local, held)
        size = float(np.hypot(size, back))
        factor, shrinks = damping, damping == 1.0 and size < min(1.0, before / 2.0)
        limit = None if shrinks or size < SMALLEST_HALVED else cost * (1.0 + ROUNDING_OF_SUM)
        begin, steps, likely = (local, common), (step_local, of_common.step), halved and limit is not None
        trial, factor = _halved(linearise, squares, begin, steps, factor, limit, likely)
        halved = factor < 1.0
        if size < 1.0:
            damping = factor
        local, common = local + factor * step_local, common + factor * of_common.step
        current, cost = trial, float(np.sum(trial.residual**2))
        if size < STEP_TOLERANCE * max(1.0, np.sqrt(cost)) or before / 2.0 < size < ROUNDING:
            return _solution(local, common, current, space, of_common, iteration)
        before = size
    if _is_settled(size, current, int(np.sum(space.rank)) + of_common.rank):
        return _solution(local, common, current, space, of_common, iteration)
    raise NotConvergedError(
        f"the identification did not converge in {most} steps: the readings contradict the machine file; "
        "check the axis signs, the topology, the order of the targets and the units"
    )


def _halved(
    linearise: Callable[[Array, Array], Linearisation],
    squares: Callable[[Array, Array], float | None],
    begin: tuple[Array, Array],
    step: tuple[Array, Array],
    factor: float,
    limit: float | None,
    is_likely: bool,
) -> tuple[Linearisation, float]:
    """What is seen after a step of the unknowns of runs and of the common ones, taken by a ``factor`` that is halved
    until the sum of squares is within a limit, if any; and the factor. Whether halving ``is_likely`` decides only what
    is computed first."""
    first = None if is_likely else factor
    for _ in range(MOST_HALVINGS):
        at = begin[0] + factor * step[0], begin[1] + factor * step[1]
        # A step that was halved is halved again as a rule: it is tried without derivatives.
        remains = None if factor == first else squares(*at)
        trial = linearise(*at) if remains is None else None
        if trial is not None:
            remains = float(np.sum(trial.residual**2))
        if limit is None or (remains is not None and remains <= limit):
            break
        factor /= 2.0
    return (linearise(*at) if trial is None else trial), factor


def _is_settled(size: float, last: Linearisation, rank: int) -> bool:
    """Whether a step of that ``size`` is next to nothing beside what a model leaves that lacks something: the relative
    offset (Bates and Watts, Technometrics 23 (1981) 179). Derivatives leave out products of errors, so that such a
    search may end short of the last digits; of what no machine of the file leaves a step says nothing. Zeros that
    nothing moves were not read: they pad the rows of a run."""
    is_read = (
        (last.residual != 0.0) | np.any(last.local != 0.0, axis=-1) | np.any(last.common != 0.0, axis=-1)
    )
    scatter = np.sqrt(np.sum(last.residual**2) / max(int(is_read.sum()) - rank, 1))
    offset = size / np.sqrt(max(rank, 1)) / max(scatter, 1.0)
    return bool(scatter < MOST_LEFT and offset < SETTLED)


def _solution(
    local: Array,
    common: Array,
    last: Linearisation,
    space: _Elimination,
    of_common: _CommonStep,
    iterations: int,
) -> Solution:
    # The last step was a hundred-thousandth of a standard deviation or less: the space before it is that after it.
    local_covariance = space.inverse @ np.swapaxes(space.inverse, -1, -2)
    reaction = space.inverse @ (np.swapaxes(space.basis, -1, -2) @ last.common)
    local_covariance = local_covariance + reaction @ of_common.covariance @ np.swapaxes(reaction, -1, -2)
    share = np.abs(space.null_space).max(axis=1)
    return Solution(
        local=local,
        common=common,
        local_covariance=local_covariance,
        common_covariance=of_common.covariance,
        local_free=share < MEMBER_SHARE,
        common_free=of_common.free,
        null_space=space.null_space,
        rank=space.rank,
        iterations=iterations,
        last=last,
    )


def inverse_of(jacobian: Array, tolerance: float) -> Array:
    """The pseudo-inverse (p, m) of derivatives (m, p), columns scaled to unit length first."""
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0.0] = 1.0
    return np.asarray(np.linalg.pinv(jacobian / scale, rcond=tolerance) / scale[:, None])
