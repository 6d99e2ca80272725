"""k_p of the hyper-ellipsoid where the covariance is a sum of parts that are known to different degrees.

One estimated covariance alone has Hotelling's T². A sum of an estimated one and known ones has no such law: a known
source of rank one makes one direction certain and none of the others. So the law of e' V^-1 e is sampled: e of the
covariance that is plugged in as true, V the sum of what the sources would be estimated at another time (Wishart, or
chi-square of a size). What is plugged in for the largest estimated part has Stein's eigenvalues relative to the rest,
and what the plug-in still changes is found by doing the same once more in the sampled world and taken off (the iterated
bootstrap: Hall, The Bootstrap and Edgeworth Expansion (1992), 1.4). docs/trials-regions.md has the coverage.

Where the rest has a part in b of r directions only, what the other directions add is integrated: a Wishart matrix from
which others are eliminated is Wishart again, with so many degrees of freedom fewer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from monitor.records import Array
from monitor.uncertainty.coverage_regions.coverage import ellipsoid_factor
from monitor.uncertainty.coverage_regions.smoothed import Quotient, quadratic_quantile, radial_quantile
from monitor.uncertainty.coverage_regions.stein import stein_eigenvalues
from monitor.uncertainty.parts import BudgetLine, Estimated
from monitor.uncertainty.roots import covariance_root

#: A part of the whitened covariance below this is none: it moves no digit of a factor.
_NEGLIGIBLE = 1e-6
#: Stands for an eigenvalue that rounding left at zero or below.
_LEAST = 1e-300
#: Operations that a group of trials may take (dimensions cubed times trials): some 20 ms.
_WORK, _MOST_TRIALS, _FEWEST_TRIALS = 2e5, 1000, 10
#: Directions for each drawn covariance.
_DIRECTIONS = 8


@dataclass(frozen=True)
class EllipsoidLaw:
    """The law of e' V^-1 e in coordinates in which all but the largest estimated part sum up to the unit matrix.

    ``rank`` r of the whole. The largest estimated part (degrees of freedom ``dof``) has the variances ``ratios`` (b,)
    in the b coordinates of the rest, falling, ``active`` of them not zero, and is all there is in the r - b others.
    ``certain`` (b, b) and ``others``, each (matrix (b, b), its degrees of freedom, what they are of), are the rest.
    """

    rank: int
    dof: float
    ratios: Array
    active: int
    certain: Array
    others: tuple[tuple[Array, float, Estimated], ...]

    @property
    def beyond(self) -> int:
        """Whether there are directions beyond those of the rest: 1, else 0."""
        return int(self.rank > len(self.ratios))

    @property
    def left_dof(self) -> float:
        """Degrees of freedom of the largest part in the coordinates of the rest, the others eliminated."""
        return self.dof - (self.rank - len(self.ratios))

    @property
    def trials(self) -> int:
        """Return how many covariances a group draws."""
        dimensions = len(self.ratios) + self.beyond
        return int(np.clip(_WORK / dimensions**3, _FEWEST_TRIALS, _MOST_TRIALS))

    def factor(self, rng: np.random.Generator, p: float) -> float:
        """Return k_p from one group of trials."""
        count = self.trials
        plugged = np.zeros_like(self.ratios)
        if self.active:
            plugged[: self.active] = self.dof * stein_eigenvalues(self.ratios[: self.active], self.left_dof)
        world = _World(
            np.broadcast_to(plugged, (count, len(plugged))),
            np.broadcast_to(self.certain, (count, *self.certain.shape)),
            [_Other.of(matrix, dof, kind, count) for matrix, dof, kind in self.others],
        )
        observed = self._observed(*self._drawn(rng, world))
        # Both worlds are drawn with the same numbers: what they have in common falls out of the quotient.
        state = rng.bit_generator.state
        k_first = self._quantile(rng, world, p)
        rng.bit_generator.state = state
        return k_first * k_first / self._quantile(rng, observed, p)

    def _drawn(self, rng: np.random.Generator, world: _World) -> tuple[Array, Array, _World]:
        """Draw what is estimated in a world: the largest part (n, a + beyond, a + beyond), the rest (n, b, b)."""
        count, a = len(world.largest), self.active
        others = [other.redrawn(rng) for other in world.others]
        rest = world.certain + sum((other.covariance for other in others), np.zeros_like(world.certain))
        wishart = wishart_roots(rng, count, a + self.beyond, self.left_dof + self.beyond)
        scale = np.concatenate([np.sqrt(world.largest[:, :a]), np.ones((count, self.beyond))], axis=1)
        root = scale[:, :, None] * wishart / math.sqrt(self.dof)
        return root @ np.swapaxes(root, 1, 2), rest, _World(world.largest, world.certain, others)

    def _quantile(self, rng: np.random.Generator, world: _World, p: float) -> float:
        """Return the p-quantile of the distance of the truth in the metric of what is drawn."""
        return self._within(rng, world, p) if not self.beyond else self._with_others(rng, world, p)

    def _within(self, rng: np.random.Generator, world: _World, p: float) -> float:
        """As ``_quantile`` where the rest has a part in every direction: the length of e is integrated."""
        part, rest, _ = self._drawn(rng, world)
        covariance = rest.copy()
        covariance[:, : self.active, : self.active] += part
        vectors = rng.standard_normal((len(rest), self.rank, _DIRECTIONS))
        vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
        vectors *= np.sqrt(world.largest + 1.0)[:, :, None]
        squares = np.sum(vectors * np.linalg.solve(covariance, vectors), axis=1)
        return radial_quantile(np.sqrt(squares.ravel()), self.rank, p)

    def _with_others(self, rng: np.random.Generator, world: _World, p: float) -> float:
        """As ``_quantile`` where there are directions without a rest: what these add is integrated.

        With g the length of e in those directions over the first diagonal of Bartlett's triangle there,
        T² = nu g² + (x + g y)' C^-1 (x + g y), with C what is estimated in the b coordinates of the rest, x normal with
        the covariance of e there and y normal with that of the largest part alone; g² is a quotient of chi-squares.
        """
        a, b = self.active, len(self.ratios)
        count = len(world.largest)
        others = [other.redrawn(rng) for other in world.others]
        covariance = world.certain + sum((other.covariance for other in others), np.zeros_like(world.certain))
        scale = np.sqrt(world.largest)
        root = scale[:, :a, None] * wishart_roots(rng, count, a, self.left_dof) / math.sqrt(self.dof)
        covariance[:, :a, :a] += root @ np.swapaxes(root, 1, 2)
        normal = rng.standard_normal((count, b, 2))
        normal[:, :, 0] *= np.sqrt(world.largest + 1.0)
        normal[:, :, 1] *= scale
        solved = np.linalg.solve(covariance, normal)
        products = np.einsum("nbi,nbj->nij", normal, solved)
        return quadratic_quantile(
            self.dof + products[:, 1, 1], products[:, 0, 1], products[:, 0, 0],
            Quotient(self.rank - b, self.left_dof + 1.0), p,
        )  # fmt: skip

    def _observed(self, part: Array, rest: Array, drawn: _World) -> _World:
        """Return what an observer of a drawn world takes for true, where its rest is the unit matrix."""
        count, a, b = len(rest), self.active, len(self.ratios)
        estimated = np.zeros((count, b, b))
        estimated[:, :a, :a] = part[:, :a, :a]
        if self.beyond:
            across = part[:, :a, a]
            estimated[:, :a, :a] -= across[:, :, None] * across[:, None, :] / part[:, a, a][:, None, None]
        whitener = np.linalg.inv(np.linalg.cholesky(rest))
        values, vectors = np.linalg.eigh(whitener @ estimated @ np.swapaxes(whitener, 1, 2))
        turn = np.swapaxes(vectors[:, :, ::-1], 1, 2) @ whitener
        largest = np.zeros((count, b))
        if a:
            ratios = np.maximum(values[:, ::-1][:, :a], _LEAST)
            largest[:, :a] = self.dof * stein_eigenvalues(ratios, self.left_dof)
        return _World(
            largest,
            turn @ drawn.certain @ np.swapaxes(turn, 1, 2),
            [replace(other, root=turn @ other.root) for other in drawn.others],
        )


@dataclass(frozen=True)
class _Other:
    """One more estimated part: ``root`` (n, b, k) of its true covariance, and how it is estimated."""

    root: Array
    dof: float
    kind: Estimated

    @staticmethod
    def of(matrix: Array, dof: float, kind: Estimated, count: int) -> _Other:
        """The part with the covariance ``matrix`` (b, b), ``count`` times.

        The unit is the rest, of which a part is a summand: what is negligible in it, or below zero by rounding, is
        dropped by that unit. In units of the part's own variances rounding would count in coordinates that it misses.
        """
        values, vectors = np.linalg.eigh(matrix)
        has_part = values > _NEGLIGIBLE
        root = vectors[:, has_part] * np.sqrt(values[has_part])
        return _Other(np.broadcast_to(root, (count, *root.shape)), dof, kind)

    def redrawn(self, rng: np.random.Generator) -> _Other:
        """What is estimated of it at another time."""
        count, _, size = self.root.shape
        if self.kind is Estimated.SCALE:
            sizes = np.sqrt(rng.chisquare(self.dof, count) / self.dof)
            return replace(self, root=self.root * sizes[:, None, None])
        return replace(self, root=self.root @ wishart_roots(rng, count, size, self.dof) / math.sqrt(self.dof))

    @property
    def covariance(self) -> Array:
        """Covariances (n, b, b)."""
        return np.asarray(self.root @ np.swapaxes(self.root, 1, 2))


@dataclass(frozen=True)
class _World:
    """What is taken for true in n trials: ``largest`` (n, b), ``certain`` (n, b, b) and the other estimated parts."""

    largest: Array
    certain: Array
    others: list[_Other]


@dataclass(frozen=True)
class SizeLaw:
    """The law of e' V^-1 e where only the size of one part is estimated: ``shares`` (r,) are its parts of the variances
    along the axes that it and all else have in common, ``dof`` its degrees of freedom."""

    shares: Array
    dof: float

    @property
    def trials(self) -> int:
        """Return how many covariances a group draws."""
        return int(np.clip(_WORK / len(self.shares), _FEWEST_TRIALS, _MOST_TRIALS))

    def factor(self, rng: np.random.Generator, p: float) -> float:
        """Return k_p from one group of trials."""
        rank, count = len(self.shares), self.trials
        first, second = rng.chisquare(self.dof, (2, count, 1)) / self.dof
        squares = rng.standard_normal((count, rank)) ** 2
        squares /= squares.sum(axis=1, keepdims=True)
        # Truth 1 and an estimate of it; that estimate as truth, and an estimate of it in turn.
        once, twice = (1.0 + (size - 1.0) * self.shares for size in (second, first * second))
        estimated = 1.0 + (first - 1.0) * self.shares
        k_first, k_second = (
            radial_quantile(np.sqrt(np.sum(squares * true / estimate, axis=1)), rank, p)
            for true, estimate in ((1.0, once), (estimated, twice))
        )
        return k_first * k_first / k_second


def ellipsoid_law(parts: Sequence[BudgetLine], p: float) -> EllipsoidLaw | SizeLaw | float:
    """Return the law to be sampled for the sum of ``parts``, each (m, m), or k_p itself where it has a closed form.

    Chi-square where nothing was estimated, Hotelling's T² or F for one estimated part alone. Infinite where a part of
    which every element was estimated has no more degrees of freedom than dimensions: nothing is known of what it does
    in the directions that it did not show.
    """
    total = np.sum([part.covariance for part in parts], axis=0)
    whitener = covariance_root(0.5 * (total + total.T)).whitener
    rank = len(whitener)
    if rank == 0:
        return ellipsoid_factor(1, p)
    white = _whitened(parts, whitener)
    if not white:
        return ellipsoid_factor(rank, p)
    if any(kind is Estimated.MATRIX and dof < _rank(matrix) + 1.0 for matrix, dof, kind in white):
        return math.inf
    certain = _symmetric(np.eye(rank) - np.sum([matrix for matrix, _, _ in white], axis=0))
    if len(white) > 1:
        return _law(white, certain, rank)
    ((matrix, dof, kind),) = white
    if float(np.abs(np.linalg.eigvalsh(certain)).max()) < _NEGLIGIBLE:
        of_one = ellipsoid_factor if kind is Estimated.MATRIX else ellipsoid_factor_of_size
        return of_one(rank, p, dof)
    if kind is Estimated.SCALE:
        return SizeLaw(np.clip(np.linalg.eigvalsh(matrix), 0.0, 1.0), dof)
    return _law(white, certain, rank)


def _whitened(parts: Sequence[BudgetLine], whitener: Array) -> list[tuple[Array, float, Estimated]]:
    """Return matrix (r, r) in units of the sum, degrees of freedom and kind of every estimated part that counts."""
    white = [
        (_symmetric(whitener @ part.covariance @ whitener.T), part.dof, part.estimated)
        for part in parts
        if part.dof is not None and not part.known
    ]
    return [entry for entry in white if np.trace(entry[0]) > _NEGLIGIBLE]


def ellipsoid_factor_of_size(outputs: int, p: float, dof: float) -> float:
    """Return k_p where the shape of the covariance is known and its size has ``dof``: k_p² = m F_p(m, nu)."""
    return math.sqrt(outputs * float(scipy.special.fdtri(outputs, dof, p)))


def _law(white: Sequence[tuple[Array, float, Estimated]], certain: Array, rank: int) -> EllipsoidLaw:
    matrices = [index for index, (_, _, kind) in enumerate(white) if kind is Estimated.MATRIX]
    reference = max(matrices, key=lambda index: float(np.trace(white[index][0])), default=None)
    rest = np.eye(rank) if reference is None else np.eye(rank) - white[reference][0]
    values, vectors = np.linalg.eigh(_symmetric(rest))
    # Rising in the rest is falling in the ratio of the largest part to it.
    inside = values > _NEGLIGIBLE
    share = np.minimum(values[inside], 1.0)
    basis = vectors[:, inside] / np.sqrt(share)
    ratios = (1.0 - share) / share
    return EllipsoidLaw(
        rank=rank,
        dof=math.inf if reference is None else white[reference][1],
        ratios=ratios,
        active=int(np.sum(ratios > _NEGLIGIBLE)),
        certain=_symmetric(basis.T @ certain @ basis),
        others=tuple(
            (_symmetric(basis.T @ matrix @ basis), dof, kind)
            for index, (matrix, dof, kind) in enumerate(white)
            if index != reference
        ),
    )


def _symmetric(matrix: Array) -> Array:
    return np.asarray(0.5 * (matrix + matrix.T))


def _rank(matrix: Array) -> int:
    return int(np.sum(np.linalg.eigvalsh(matrix) > _NEGLIGIBLE))


def wishart_roots(rng: np.random.Generator, count: int, size: int, dof: float) -> Array:
    """Return lower triangles T (count, size, size): T T^T is a Wishart matrix with ``dof`` (Bartlett 1933)."""
    roots = np.zeros((count, size, size))
    rows, columns = np.tril_indices(size, -1)
    roots[:, rows, columns] = rng.standard_normal((count, len(rows)))
    for index in range(size):
        roots[:, index, index] = np.sqrt(rng.chisquare(dof - index, count))
    return roots
