"""Evidence for effects: how much of the residual each explains, given the effects already selected.

For every candidate the part of the residual's sum of squares that its visible columns explain is tested by F
against what stays, and ranked by the logarithm of the likelihood ratio less the price of its coefficients
(Schwarz's criterion), which stays finite where p-values underflow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Generic, NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from monitor.discovery.search.candidate import SMALLEST_SHARE, Candidate
from monitor.discovery.search.projection import eigen, orthonormal, without
from monitor.discovery.search.remainder import Remainder
from monitor.discovery.search.scene import CandidateT, Scene
from monitor.discovery.search.together import together
from monitor.records import Array

# A direction of which the selected effects leave less than this part (squared) has nothing to say.
SMALLEST_REMAINDER = 1e-8
# Effects that would have to be larger than a machine in use hides (an angle of 1 mrad with hardly a lever) are
# weighed with odds of 1 to 400: their p-values are multiplied by it (weighted false discovery rate: Genovese,
# Roeder and Wasserman, Biometrika 93 (2006) 509) and their scores lose twice its logarithm.
ODDS_OF_TOO_LARGE = 400.0
# What would have to be a hundred times as large (0.1 rad, 5 mm) is no error but another machine; so far the
# linearised columns do not reach. A scale that shrinks the whole machine explains any residual.
BEYOND = 100.0
# So many products with selected effects are remembered, some hundreds of MB of a few columns each at most.
MOST_PRODUCTS = 4_000_000
# Scores that are one to so many decimals differ by rounding: no answer hangs on the last bits of an exact tie.
SAME = 4
# So many standard deviations of a coefficient are put down to noise before its size is judged.
STANDS_OUT = 3.0


class Evidence(NamedTuple, Generic[CandidateT]):
    """The evidence for one candidate: F with ``rank`` degrees of freedom in its numerator, its p-value and score.

    ``too_large`` says that it would need coefficients beyond what a machine in use is likely to have.
    """

    candidate: CandidateT
    explained: float
    rank: int
    f: float
    p_value: float
    score: float
    too_large: bool = False

    @property
    def likelihood(self) -> float:
        """The score without the odds beforehand: what the data alone say."""
        odds = self.candidate.variant.odds * (ODDS_OF_TOO_LARGE if self.too_large else 1.0)
        return self.score + 2.0 * float(np.log(odds)) + self.candidate.behind


@dataclass(frozen=True)
class Pool(Generic[CandidateT]):
    """Candidates to be weighed together, again and again: their columns side by side, and their products with those of
    effects that were selected beside them, each computed once."""

    candidates: tuple[CandidateT, ...]
    _products: dict[int, tuple[object, Array]] = field(default_factory=dict, compare=False, repr=False)

    @cached_property
    def blocks(self) -> tuple[Array, ...]:
        """All columns in blocks (k, M), one row each, of which few are copies."""
        return together([candidate.columns.T for candidate in self.candidates])

    @cached_property
    def rows(self) -> Array:
        """All columns (K, M), one row each."""
        return np.concatenate(self.blocks)

    def products(self, columns: Array, numbers: slice = slice(None)) -> Array:
        """The products (K, ...) of some ``numbers`` of all columns with those of others (m, ...)."""
        return np.concatenate([block[:, numbers] @ columns for block in self.blocks])

    def overlap(self, beside: Remainder) -> Array:
        """The products (K, r) of all columns with the basis of what selected effects span."""
        products = [self._product(beside.shared, beside.shared)]
        products += [self._product(candidate, candidate.columns) for candidate in beside.selected]
        return np.concatenate(products, axis=1) @ beside.combinations

    def onto(self, beside: Remainder, overlap: Array) -> Array:
        """The products (K,) of all columns with what selected effects leave, of which ``overlap`` (K, r) is known."""
        return self._product(beside.whole, beside.whole) - overlap @ (beside.basis.T @ beside.whole)

    def _product(self, owner: object, columns: Array) -> Array:
        """The products of all columns with those of an owner."""
        product = self._products.get(id(owner))
        if product is None:
            if len(self._products) * len(self.lengths) > MOST_PRODUCTS:
                self._products.clear()
            # The owner is kept too: an identity is only that of an object that exists.
            product = self._products[id(owner)] = owner, self.products(columns)
        return product[1]

    @cached_property
    def by_size(self) -> dict[int, tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]]:
        """By number of coefficients k: indices (n,) of the candidates, and (n, k) of their rows."""
        sizes = np.array([candidate.columns.shape[1] for candidate in self.candidates])
        first = np.cumsum(sizes) - sizes
        return {
            int(size): (members := np.flatnonzero(sizes == size), first[members][:, None] + np.arange(size))
            for size in np.unique(sizes)
        }

    @cached_property
    def lengths(self) -> Array:
        """Length (K,) of every column; 1 where there is nothing."""
        squares = np.concatenate([np.diagonal(candidate.gram) for candidate in self.candidates])
        return np.where(squares == 0.0, 1.0, np.sqrt(squares))

    @cached_property
    def grams(self) -> dict[int, Array]:
        """By number of coefficients: products (n, k, k) of the columns scaled to unit length."""
        grams = {}
        for size, (members, rows) in self.by_size.items():
            lengths = self.lengths[rows]
            unscaled = np.array([self.candidates[member].gram for member in members])
            grams[size] = unscaled.reshape(-1, size, size) / (lengths[:, :, None] * lengths[:, None, :])
        return grams

    @cached_property
    def family(self) -> npt.NDArray[np.int64]:
        """The number (n,) of the family of each candidate."""
        numbers: dict[str, int] = {}
        return np.array([numbers.setdefault(each.family, len(numbers)) for each in self.candidates])

    @cached_property
    def tries(self) -> Array:
        """The number of variants of each candidate that are searched."""
        return np.array([float(candidate.variant.tries) for candidate in self.candidates])

    @cached_property
    def odds(self) -> Array:
        """The odds against each candidate beforehand."""
        return np.array([candidate.variant.odds for candidate in self.candidates])

    @cached_property
    def behind(self) -> Array:
        """By how much the score of each candidate stands behind that of a likelier cause which does the same."""
        return np.array([candidate.behind for candidate in self.candidates])

    @cached_property
    def least(self) -> Array:
        """The part (squared) of a direction of each candidate from which on it is determined beside others."""
        return least_remainder(np.array([candidate.share for candidate in self.candidates]))

    @cached_property
    def largest(self) -> Array:
        """The largest coefficients that are likely."""
        return np.array([candidate.largest for candidate in self.candidates])

    def with_more(self, more: Sequence[CandidateT]) -> Pool[CandidateT]:
        """The pool and further candidates of families that it lacks."""
        families = {candidate.family for candidate in self.candidates}
        new = [candidate for candidate in more if candidate.family not in families]
        return Pool((*self.candidates, *new)) if new else self


def least_remainder(shares: Array) -> Array:
    """The part (squared) of a direction from which on it is determined beside others, by the ``shares`` that what is
    free in every run leaves.

    Below it a fit holds the direction: of the whole effect, what is free in every run included, less is left than
    products of small errors leave.
    """
    least: Array = np.maximum((SMALLEST_SHARE / np.maximum(shares, SMALLEST_SHARE)) ** 2, SMALLEST_REMAINDER)
    return least


def pool_of(scene: Scene[CandidateT]) -> Pool[CandidateT]:
    """The candidates of which the data see anything."""
    return Pool(tuple(candidate for candidate in scene.candidates if candidate.visible))


def weigh(
    candidates: Sequence[CandidateT] | Pool[CandidateT],
    residual: Array,
    selected: Array,
    degrees_of_freedom: int,
) -> list[Evidence[CandidateT]]:
    """Weigh every candidate, given the selected columns (M, c); the most convincing first.

    ``degrees_of_freedom`` are those of ``residual`` (M,) before the selected columns are taken out.
    """
    pool = candidates if isinstance(candidates, Pool) else Pool(tuple(candidates))
    if not pool.candidates:
        return []
    basis = orthonormal(selected)
    remainder = without(basis, residual[:, None])[:, 0]
    squares = float(remainder @ remainder), degrees_of_freedom - basis.shape[1]
    weights = _weighed(pool, pool.products(basis), pool.products(remainder), squares)
    return weights.of(pool, weights.order)


@dataclass(frozen=True)
class _Weights:
    """The evidence (n,) for each candidate of a pool."""

    explained: Array
    rank: npt.NDArray[np.int64]
    f: Array
    p_value: Array
    score: Array
    too_large: npt.NDArray[np.bool_]

    @property
    def order(self) -> npt.NDArray[np.int64]:
        """The numbers of the candidates, the most convincing first; of those that say the same the first."""
        return np.argsort(-np.round(self.score, SAME), kind="stable")

    def of(self, pool: Pool[CandidateT], numbers: npt.NDArray[np.int64]) -> list[Evidence[CandidateT]]:
        """The evidence for some candidates of the pool."""
        arrays = (self.explained, self.rank, self.f, self.p_value, self.score, self.too_large)
        values = (array[numbers].tolist() for array in arrays)
        return list(map(Evidence, map(pool.candidates.__getitem__, numbers.tolist()), *values))


def _weighed(pool: Pool[CandidateT], overlap: Array, onto: Array, squares: tuple[float, int]) -> _Weights:
    """Weigh every candidate of a pool by the products of its columns with an orthonormal basis (K, r) of what is
    selected and with what that leaves (K,), of which ``squares`` is the sum of squares with its degrees of freedom."""
    total, dof = squares
    onto = onto / pool.lengths
    overlap = overlap / pool.lengths[:, None]
    explained = np.zeros(len(pool.candidates))
    rank = np.zeros(len(pool.candidates), dtype=np.int64)
    large = np.zeros(len(pool.candidates))
    for size, (members, rows) in pool.by_size.items():
        gram = pool.grams[size] - overlap[rows] @ np.swapaxes(overlap[rows], -1, -2)
        explained[members], rank[members], coefficients = explained_by(
            gram, onto[rows], total, dof, pool.least[members]
        )
        large[members] = np.sqrt(np.sum((coefficients / pool.lengths[rows]) ** 2, axis=-1))
    rank[large > BEYOND * pool.largest] = 0
    return _weights(pool, explained, rank, (total, dof), large > pool.largest)


def weigh_beside(
    scene: Scene[CandidateT],
    candidates: Sequence[CandidateT] | Pool[CandidateT],
    selected: Sequence[Candidate[object]],
) -> list[Evidence[CandidateT]]:
    """Weigh every candidate beside the selected ones, the most convincing first."""
    return weigh_in(scene.remainders.beside(selected), candidates)


def weigh_in(
    beside: Remainder, candidates: Sequence[CandidateT] | Pool[CandidateT]
) -> list[Evidence[CandidateT]]:
    """Weigh every candidate in what selected effects leave, the most convincing first."""
    if isinstance(candidates, Pool):
        weights = _weighed_again(beside, candidates)
        return weights.of(candidates, weights.order)
    # Nothing is gained by products with each selected effect of candidates that are weighed once.
    pool = Pool(tuple(candidates))
    if not pool.candidates:
        return []
    squares = float(beside.residual @ beside.residual), beside.degrees_of_freedom
    weights = _weighed(pool, pool.products(beside.basis), pool.products(beside.residual), squares)
    return weights.of(pool, weights.order)


def best_of_families_in(
    beside: Remainder, pool: Pool[CandidateT], able: npt.NDArray[np.bool_] | None = None
) -> list[Evidence[CandidateT]]:
    """The best of every family of a pool in what selected effects leave, most convincing first; only of those that are
    ``able`` (n,), if given."""
    weights = _weighed_again(beside, pool)
    order = weights.order if able is None else weights.order[able[weights.order]]
    first = np.unique(pool.family[order], return_index=True)[1]
    return weights.of(pool, order[np.sort(first)])


def _weighed_again(beside: Remainder, pool: Pool[CandidateT]) -> _Weights:
    """Weigh every candidate of a pool that remembers its products with selected effects."""
    overlap = pool.overlap(beside)
    squares = float(beside.residual @ beside.residual), beside.degrees_of_freedom
    return _weighed(pool, overlap, pool.onto(beside, overlap), squares)


def explained_by(
    gram: Array, onto: Array, total: float = 0.0, dof: int = 1, least: Array | None = None
) -> tuple[Array, npt.NDArray[np.int64], Array]:
    """Sum of squares (...) that columns with products ``gram`` (..., k, k) explain, their rank (...) and their
    coefficients (..., k), as far as these stand out from the noise that ``total`` and ``dof`` show. Directions with a
    part (squared) of at most ``least`` (...) are held."""
    values, vectors = eigen(gram)
    keep = values > (SMALLEST_REMAINDER if least is None else least[..., None])
    along = np.einsum("...ij,...i->...j", vectors, onto)
    inverse = np.where(keep, 1.0 / np.where(keep, values, 1.0), 0.0)
    explained: Array = np.sum(along**2 * inverse, axis=-1)
    # A direction that the plan barely sees has a large coefficient from noise alone.
    noise = np.maximum(total - explained, 0.0)[..., None] / max(dof, 1) * values
    sure = along * np.sqrt(np.maximum(1.0 - STANDS_OUT**2 * noise / np.maximum(along**2, 1e-300), 0.0))
    coefficients: Array = np.einsum("...ij,...j->...i", vectors, sure * inverse)
    return explained, keep.sum(axis=-1), coefficients


def evidence_of(
    pool: Pool[CandidateT],
    explained: Array,
    rank: npt.NDArray[np.int64],
    residual: tuple[float, int],
    too_large: npt.NDArray[np.bool_],
) -> list[Evidence[CandidateT]]:
    """Evidence for the candidates of a pool that explain sums of squares (n,) with ranks (n,) of a ``residual`` with
    this sum of squares and degrees of freedom."""
    weights = _weights(pool, explained, rank, residual, too_large)
    return weights.of(pool, np.arange(len(pool.candidates)))


def _weights(
    pool: Pool[CandidateT],
    explained: Array,
    rank: npt.NDArray[np.int64],
    residual: tuple[float, int],
    too_large: npt.NDArray[np.bool_],
) -> _Weights:
    """The numbers of `evidence_of`."""
    total, dof = residual
    able = (rank > 0) & (dof > rank) & (total > 0)
    number, other = np.where(able, rank, 1), np.where(able, dof - rank, 1)
    stays = np.maximum(total - explained, 1e-300)
    f = np.where(able, (explained / number) / (stays / other), 0.0)
    odds = pool.tries * pool.odds * np.where(too_large, ODDS_OF_TOO_LARGE, 1.0)
    p_value = np.where(able, np.minimum(1.0, scipy.special.fdtrc(number, other, f) * odds), 1.0)
    score = scores_of(explained, rank, residual, odds) - pool.behind
    return _Weights(np.where(able, explained, 0.0), rank, f, p_value, score, too_large)


def scores_of(
    explained: Array, rank: npt.NDArray[np.int64], residual: tuple[float, int], odds: Array
) -> Array:
    """The scores (n,) of what explains sums of squares (n,) with ranks (n,) of a ``residual``, with ``odds`` (n,)
    against each; minus infinity where nothing can be explained."""
    total, dof = residual
    able = (rank > 0) & (dof > rank) & (total > 0)
    stays = np.maximum(total - explained, 1e-300)
    price = rank * np.log(max(dof, 1)) + 2.0 * np.log(odds)
    return np.where(able, dof * np.log(max(total, 1e-300) / stays) - price, -np.inf)


def best_of_families(weighed: Sequence[Evidence[CandidateT]]) -> list[Evidence[CandidateT]]:
    """The best variant of every family, most convincing first."""
    best: dict[str, Evidence[CandidateT]] = {}
    for evidence in weighed:
        best.setdefault(evidence.candidate.family, evidence)
    return list(best.values())
