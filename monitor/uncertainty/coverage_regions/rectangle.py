"""k_q of the hyper-rectangle where the covariance is a sum of parts that are known to different degrees.

The p-quantile of max_j |e_j|/u_j, with e of the covariance that is plugged in as true and u_j of what the sources would
be estimated at another time: the factor that the correlations and the degrees of freedom of these very parts ask for,
no bound. What the plug-in changes is found in a second sampled world and taken off, as for the ellipsoid.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy

from monitor.records import Array
from monitor.uncertainty.coverage_regions.coverage import rectangle_factor
from monitor.uncertainty.coverage_regions.ellipsoid import wishart_roots
from monitor.uncertainty.coverage_regions.tails import TAILS_ERROR, PartTails, Tails, normal_tails, tails_of
from monitor.uncertainty.parts import BudgetLine, Estimated

#: A part below this share of every variance is none.
_NEGLIGIBLE = 1e-6
#: Operations that a group of trials may take, some 5 ms, and the trials of a group at least and at most.
_WORK, _FEWEST_TRIALS, _MOST_TRIALS = 2.5e4, 50, 5000
#: So many outputs lead in a group of trials.
_MOST_LEADING = 24
#: The search ends where the tail is within this part of what is wanted, or after so many steps.
_SOLVED, _MOST_STEPS = 1e-3, 24
#: A tail below this is none, and the square of a factor of which no end is known is taken so many times as large.
_LEAST_TAIL, _FARTHER = 1e-12, 4.0


@dataclass(frozen=True)
class Part:
    """``roots`` (n, m, k) or (1, m, k) of a part's true covariances, and how it is estimated; known where infinite."""

    roots: Array
    dof: float
    kind: Estimated

    def redrawn(self, rng: np.random.Generator, count: int) -> Part:
        """What is estimated of it at another time, ``count`` times."""
        if math.isinf(self.dof):
            return self
        size = self.roots.shape[2]
        if self.kind is Estimated.SCALE:
            sizes = np.sqrt(rng.chisquare(self.dof, count) / self.dof)
            return replace(self, roots=self.roots * sizes[:, None, None])
        if self.dof >= size:
            drawn = wishart_roots(rng, count, size, self.dof)
        else:
            drawn = rng.standard_normal((count, size, _drawn_runs(self.dof)))
        return replace(self, roots=self.roots @ drawn / math.sqrt(self.dof))

    @property
    def variances(self) -> Array:
        """Variances (n, m) or (1, m)."""
        return np.asarray(np.einsum("nmk,nmk->nm", self.roots, self.roots))

    @property
    def tails(self) -> PartTails:
        """What one variance of it does by itself when it is redrawn, and redrawn once more."""
        size, first, second = self.roots.shape[2], self.dof, self.dof
        if self.kind is Estimated.MATRIX and self.dof < size:
            first = float(_drawn_runs(self.dof))
            second = self.dof if self.dof >= first else first
        return PartTails(self.variances[0], self.dof, first, second)


def _drawn_runs(dof: float) -> int:
    """How many runs are drawn of a part that has fewer degrees of freedom than dimensions."""
    return max(1, math.floor(dof))


@dataclass(frozen=True)
class RectangleLaw:
    """The law of max_j |e_j|/u_j: roots (m, k) of every part of the correlation matrix, degrees of freedom, kind."""

    parts: tuple[tuple[Array, float, Estimated], ...]
    _kept: dict[float, tuple[Tails, Tails]] = field(default_factory=dict, init=False, repr=False)

    def factor(self, rng: np.random.Generator, p: float) -> float:
        """Return k_q from one group of trials."""
        count = self.trials
        world = [Part(root[None], dof, kind) for root, dof, kind in self.parts]
        if all(math.isinf(part.dof) for part in world):
            return _quantile(rng, world, count, p, normal_tails(len(self.parts[0][0])))
        of_world, of_observed = self._tails(p)
        observed = [part.redrawn(rng, count) for part in world]
        state = rng.bit_generator.state
        k_first = _quantile(rng, world, count, p, of_world)
        rng.bit_generator.state = state
        return k_first * k_first / _quantile(rng, observed, count, p, of_observed)

    def _tails(self, p: float) -> tuple[Tails, Tails]:
        """The sums of tails of both worlds, the same for every group."""
        if p not in self._kept:
            world = [Part(root[None], dof, kind) for root, dof, kind in self.parts]
            self._kept[p] = tails_of([part.tails for part in world], p)
        return self._kept[p]

    @property
    def common_error(self) -> float:
        """The standard error, as a part of the factor, of what all groups have in common."""
        return 0.0 if all(math.isinf(dof) for _, dof, _ in self.parts) else TAILS_ERROR

    @property
    def trials(self) -> int:
        """Return how many covariances a group draws."""
        outputs = len(self.parts[0][0])
        return int(np.clip(_WORK / (outputs * min(outputs, _MOST_LEADING)), _FEWEST_TRIALS, _MOST_TRIALS))


def rectangle_law(parts: Sequence[BudgetLine]) -> RectangleLaw:
    """Return the law for the sum of ``parts``, each (m, m); outputs without variance take no part in it."""
    total = np.sum([part.covariance for part in parts], axis=0)
    u = np.sqrt(np.diag(total))
    varies = np.flatnonzero(u > 0.0)
    scale = np.outer(u[varies], u[varies])

    def shared(covariance: Array) -> Array:
        matrix = covariance[np.ix_(varies, varies)] / scale
        return np.asarray(0.5 * (matrix + matrix.T))

    estimated = [
        (shared(part.covariance), part.dof, part.estimated)
        for part in parts
        if part.dof is not None and not part.known
    ]
    estimated = [entry for entry in estimated if float(np.diag(entry[0]).max(initial=0.0)) > _NEGLIGIBLE]
    certain = shared(total) - np.sum([np.zeros_like(scale), *(matrix for matrix, _, _ in estimated)], axis=0)
    laws = [(_root(matrix), dof, kind) for matrix, dof, kind in estimated]
    if float(np.diag(certain).max(initial=0.0)) > _NEGLIGIBLE:
        np.einsum("ii->i", certain)[:] = np.maximum(np.diag(certain), 0.0)
        laws.append((_root(certain), math.inf, Estimated.SCALE))
    return RectangleLaw(tuple(laws))


def _root(matrix: Array) -> Array:
    """Root (m, k) of a part of a correlation matrix, rounding below zero left out.

    Cholesky's where there is one, which moves with the matrix: eigenvectors may turn by its last digit, and with them
    the sampled factor by its standard error.
    """
    try:
        root = np.linalg.cholesky(matrix)
        if float(np.diag(root).min()) ** 2 > _NEGLIGIBLE * float(np.diag(matrix).max()):
            return np.asarray(root)
    except np.linalg.LinAlgError:
        pass
    values, vectors = np.linalg.eigh(matrix)
    largest = np.take_along_axis(vectors, np.argmax(np.abs(vectors), axis=0)[None, :], axis=0)
    vectors = vectors * np.where(largest < 0.0, -1.0, 1.0)
    inside = values > _NEGLIGIBLE * max(float(values[-1]), 0.0)
    return np.asarray(vectors[:, inside] * np.sqrt(values[inside]))


def _quantile(rng: np.random.Generator, world: Sequence[Part], count: int, p: float, tails: Tails) -> float:
    """Return the p-quantile of the largest deviation in what is estimated of a world.

    The probability that any output exceeds k u_j is the sum over the outputs of that of each, ``tails``, times the
    mean of one over how many exceed together with it (Adler, Blanchet and Liu, Ann. Appl. Probab. 22 (2012) 1167):
    that of each is computed from the normal law, only the others are counted. The sum is known far better than these
    trials show it, so they give that mean alone, a ratio in which their own sum falls out.
    """
    outputs = world[0].roots.shape[1]
    none = np.zeros((1, outputs))
    u = np.sqrt(sum((part.redrawn(rng, count).variances for part in world), none))
    sigma = np.sqrt(sum((part.variances for part in world), none))
    deviations = np.zeros((count, outputs))
    for part in world:
        normal = rng.standard_normal((count, part.roots.shape[2], 1))
        deviations += (part.roots @ normal)[:, :, 0]
    # Every output leads where there are few, else some of them, drawn anew in every group.
    leading = rng.permutation(outputs)[:_MOST_LEADING]
    across = sum(
        (part.roots @ np.swapaxes(part.roots[:, leading], 1, 2) for part in world),
        np.zeros((1, outputs, len(leading))),
    )
    slope = across / sigma[:, None, leading] ** 2
    others = deviations[:, :, None] - slope * deviations[:, None, leading]
    uniform = rng.random((count, len(leading)))
    limit, ratio = u[:, :, None], np.broadcast_to(u[:, leading] / sigma[:, leading], uniform.shape)
    lead = np.arange(len(leading))

    def beyond(k: float) -> float:
        tail = scipy.special.ndtr(-k * ratio)
        reached = -scipy.special.ndtri(tail * uniform) * sigma[:, leading]
        exceeds = np.abs(others + slope * reached[:, None, :]) > k * limit
        exceeds[:, leading, lead] = True
        together = np.count_nonzero(exceeds, axis=1)
        return tails(k) * float(np.sum(tail / together) / np.sum(tail))

    return _solved(beyond, 1.0 - p, outputs)


def _solved(beyond: Callable[[float], float], tail: float, outputs: int) -> float:
    """Return k with ``beyond(k) = tail``: the logarithm of a tail is nearly straight in k².

    Of heavy tails it is not: a step that leaves what the values so far enclose goes to the middle of that, or so many
    times farther out as long as no end is known there.
    """

    def over(square: float) -> float:
        return math.log(max(beyond(math.sqrt(square)), _LEAST_TAIL) / tail)

    low = rectangle_factor(1, 1.0 - tail)
    ends = [(k * k, over(k * k)) for k in (low, rectangle_factor(outputs + 1, 1.0 - tail))]
    for _ in range(_MOST_STEPS):
        (first, at_first), (second, at_second) = ends[-2:]
        if abs(at_second) < _SOLVED:
            break
        inside = max((square for square, at in ends if at > 0.0), default=0.25 * low * low)
        outside = min((square for square, at in ends if at < 0.0), default=math.inf)
        farthest = outside if math.isfinite(outside) else _FARTHER * inside
        flat = at_first == at_second
        square = math.inf if flat else second - at_second * (second - first) / (at_second - at_first)
        if not inside < square < farthest:
            square = 0.5 * (inside + outside) if math.isfinite(outside) else farthest
        ends.append((square, over(square)))
    return math.sqrt(min(ends, key=lambda end: abs(end[1]))[0])
