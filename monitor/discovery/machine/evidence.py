"""Evidence for effects: how much of the residual each explains, given the effects already chosen.

For every candidate the part of the residual's sum of squares that its visible columns explain is tested by F
against what stays, and ranked by the logarithm of the likelihood ratio less the price of its coefficients
(Schwarz's criterion), which stays finite where p-values underflow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy import special

from monitor.discovery.machine.visible import Candidate, Visible
from monitor.records import Array

# Eigenvalues of a candidate's scaled normal matrix below this belong to directions without data.
RELATIVE_RANK = 1e-9
# A direction of which the chosen effects leave less than this part (squared) has nothing to say.
SMALLEST_LEFT = 1e-8
# Effects that would have to be larger than a machine in use hides (an angle of 1 mrad with hardly a lever) are
# weighed with odds of 1 to 400: their p-values are multiplied by it (weighted false discovery rate: Genovese,
# Roeder and Wasserman, Biometrika 93 (2006) 509) and their scores lose twice its logarithm.
ODDS_OF_TOO_LARGE = 400.0
# What would have to be a hundred times as large (0.1 rad, 5 mm) is no error but another machine; so far the
# linearised columns do not reach. A scale that shrinks the whole machine explains any residual.
BEYOND = 100.0
# So many standard deviations of a coefficient are put down to noise before its size is judged.
STANDS_OUT = 3.0
# Sizes of an effect scatter from run to run where noise alone would do so once in a thousand times.
SCATTERS = 1e-3


@dataclass(frozen=True)
class Evidence:
    """What one candidate explains: F with ``rank`` degrees of freedom in its numerator, its p-value and score.

    ``too_large`` says that it would need coefficients beyond what a machine in use is likely to have.
    """

    candidate: Candidate
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
        return self.score + 2.0 * float(np.log(odds))


def orthonormal(columns: Array) -> Array:
    """An orthonormal basis (M, rank) of what columns (M, k) span."""
    if columns.shape[1] == 0:
        return columns
    scale = np.linalg.norm(columns, axis=0)
    scaled = columns / np.where(scale == 0, 1.0, scale)
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    keep = values > RELATIVE_RANK * max(float(values.max()), 1.0)
    basis: Array = scaled @ (vectors[:, keep] / np.sqrt(values[keep]))
    return basis


def without(basis: Array, columns: Array) -> Array:
    """Columns with the span of an orthonormal basis taken out."""
    if basis.shape[1] == 0:
        return columns
    left: Array = columns - basis @ (basis.T @ columns)
    return left


@dataclass(frozen=True)
class Pool:
    """Candidates to be weighed together, again and again: their columns side by side."""

    candidates: tuple[Candidate, ...]

    @cached_property
    def rows(self) -> Array:
        """All columns (K, M), one row each."""
        return np.concatenate([candidate.columns.T for candidate in self.candidates])

    @cached_property
    def places(self) -> dict[int, tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]]:
        """By number of coefficients k: which candidates (n,), and the places (n, k) of their columns."""
        sizes = np.array([candidate.columns.shape[1] for candidate in self.candidates])
        first = np.cumsum(sizes) - sizes
        return {
            int(size): (own := np.flatnonzero(sizes == size), first[own][:, None] + np.arange(size))
            for size in np.unique(sizes)
        }

    @cached_property
    def lengths(self) -> Array:
        """Length (K,) of every column; 1 where there is nothing."""
        length = np.sqrt(np.einsum("km,km->k", self.rows, self.rows))
        return np.where(length == 0, 1.0, length)

    @cached_property
    def grams(self) -> dict[int, Array]:
        """By number of coefficients: products (n, k, k) of the columns scaled to unit length."""
        found = {}
        for size, (_, at) in self.places.items():
            part = self.rows[at] / self.lengths[at][..., None]
            found[size] = part @ np.swapaxes(part, -1, -2)
        return found

    @cached_property
    def tries(self) -> Array:
        """How many variants of each candidate are searched."""
        return np.array([float(candidate.variant.tries) for candidate in self.candidates])

    @cached_property
    def odds(self) -> Array:
        """The odds against each candidate beforehand."""
        return np.array([candidate.variant.odds for candidate in self.candidates])

    @cached_property
    def largest(self) -> Array:
        """The largest coefficients that are likely."""
        return np.array([candidate.largest for candidate in self.candidates])

    def with_more(self, more: Sequence[Candidate]) -> Pool:
        """The pool and further candidates of families that it lacks."""
        known = {candidate.family for candidate in self.candidates}
        return Pool((*self.candidates, *(one for one in more if one.family not in known)))


def weigh(
    candidates: Sequence[Candidate] | Pool, residual: Array, chosen: Array, degrees_of_freedom: int
) -> list[Evidence]:
    """Evidence for every candidate, given the chosen columns (M, c), most convincing first.

    ``degrees_of_freedom`` are those of ``residual`` (M,) before the chosen columns are taken out.
    """
    pool = candidates if isinstance(candidates, Pool) else Pool(tuple(candidates))
    if not pool.candidates:
        return []
    basis = orthonormal(chosen)
    left = without(basis, residual[:, None])[:, 0]
    total, dof = float(left @ left), degrees_of_freedom - basis.shape[1]
    onto = (pool.rows @ left) / pool.lengths
    taken = (pool.rows @ basis) / pool.lengths[:, None]
    explained = np.zeros(len(pool.candidates))
    rank = np.zeros(len(pool.candidates), dtype=np.int64)
    large = np.zeros(len(pool.candidates))
    for size, (own, at) in pool.places.items():
        gram = pool.grams[size] - taken[at] @ np.swapaxes(taken[at], -1, -2)
        explained[own], rank[own], coefficients = _explained(gram, onto[at], total, dof)
        large[own] = np.sqrt(np.sum((coefficients / pool.lengths[at]) ** 2, axis=-1))
    rank[large > BEYOND * pool.largest] = 0
    found = _evidence(pool, explained, rank, total, dof, large > pool.largest)
    return sorted(found, key=lambda one: -one.score)


def _explained(
    gram: Array, onto: Array, total: float = 0.0, dof: int = 1
) -> tuple[Array, npt.NDArray[np.int64], Array]:
    """Sum of squares (...) that columns with products ``gram`` (..., k, k) explain, their rank (...) and their
    coefficients (..., k), as far as these stand out from the noise that ``total`` and ``dof`` tell of."""
    values, vectors = np.linalg.eigh(gram)
    keep = values > SMALLEST_LEFT
    along = np.einsum("...ij,...i->...j", vectors, onto)
    inverse = np.where(keep, 1.0 / np.where(keep, values, 1.0), 0.0)
    explained: Array = np.sum(along**2 * inverse, axis=-1)
    # A direction that the plan barely sees has a large coefficient from noise alone.
    noise = np.maximum(total - explained, 0.0)[..., None] / max(dof, 1) * values
    sure = along * np.sqrt(np.maximum(1.0 - STANDS_OUT**2 * noise / np.maximum(along**2, 1e-300), 0.0))
    coefficients: Array = np.einsum("...ij,...j->...i", vectors, sure * inverse)
    return explained, keep.sum(axis=-1), coefficients


def _evidence(
    pool: Pool,
    explained: Array,
    rank: npt.NDArray[np.int64],
    total: float,
    dof: int,
    too_large: npt.NDArray[np.bool_],
) -> list[Evidence]:
    able = (rank > 0) & (dof > rank) & (total > 0)
    number, other = np.where(able, rank, 1), np.where(able, dof - rank, 1)
    stays = np.maximum(total - explained, 1e-300)
    f = np.where(able, (explained / number) / (stays / other), 0.0)
    odds = pool.tries * pool.odds * np.where(too_large, ODDS_OF_TOO_LARGE, 1.0)
    p_value = np.where(able, np.minimum(1.0, special.fdtrc(number, other, f) * odds), 1.0)
    price = rank * np.log(max(dof, 1)) + 2.0 * np.log(odds)
    score = np.where(able, dof * np.log(max(total, 1e-300) / stays) - price, -np.inf)
    return [
        Evidence(
            candidate, float(explained[one]) if able[one] else 0.0, int(rank[one]), float(f[one]),
            float(p_value[one]), float(score[one]), bool(too_large[one]),
        )
        for one, candidate in enumerate(pool.candidates)
    ]  # fmt: skip


def best_of_families(found: Sequence[Evidence]) -> list[Evidence]:
    """The best variant of every family, most convincing first."""
    best: dict[str, Evidence] = {}
    for one in found:
        best.setdefault(one.candidate.family, one)
    return list(best.values())


def _run_by_run(
    rows: Array, residual: Array, lengths: Array, places: npt.NDArray[np.int64]
) -> tuple[Array, npt.NDArray[np.int64]]:
    """What candidates explain (n,) with another size in every run, and the rank (n,) of that.

    ``rows`` (K, R, N) are columns and ``residual`` (R, N) run by run, ``lengths`` (K,) of whole columns, ``places``
    (n, k) of each candidate's columns.
    """
    length = np.sqrt(np.einsum("krm,krm->kr", rows, rows))
    # A run in which an effect leaves next to nothing says nothing of it.
    seen = length > np.sqrt(SMALLEST_LEFT) * lengths[:, None]
    scaled = np.where(seen[..., None], rows / np.where(seen, length, 1.0)[..., None], 0.0)
    onto = np.einsum("krm,rm->kr", scaled, residual)
    gram = np.einsum("nirm,njrm->nrij", scaled[places], scaled[places])
    squares, ranks, _ = _explained(gram, np.swapaxes(onto[places], 1, 2))
    return squares.sum(axis=-1), ranks.sum(axis=-1)


def weigh_in_each_run(candidates: Sequence[Candidate], visible: Visible) -> list[Evidence]:
    """Evidence for candidates that have another size in every run, given what the model has already.

    The effects already added are common to all runs; that they take part of the columns out is neglected here
    (one coefficient against one a run).
    """
    pool = Pool(tuple(candidates))
    if not pool.candidates:
        return []
    runs = len(np.unique(visible.run))
    rows, residual = pool.rows.reshape(len(pool.rows), runs, -1), visible.residual.reshape(runs, -1)
    explained = np.zeros(len(pool.candidates))
    rank = np.zeros(len(pool.candidates), dtype=np.int64)
    for own, at in pool.places.values():
        explained[own], rank[own] = _run_by_run(rows, residual, pool.lengths, at)
    total = float(visible.residual @ visible.residual)
    likely = np.zeros(len(pool.candidates), dtype=bool)
    return sorted(
        _evidence(pool, np.minimum(explained, total), rank, total, visible.degrees_of_freedom, likely),
        key=lambda one: one.p_value,
    )


def p_value_against_runs(candidate: Candidate, visible: Visible, others: Sequence[Candidate]) -> float:
    """p-value of an effect's common size against how its size scatters from run to run, given others.

    Where the sizes of the runs scatter no more than noise does, the noise is the better yardstick: 0. Else each
    run is one observation, however many probings it has; with one run that cannot be told: 0.
    """
    runs = len(np.unique(visible.run))
    if runs < 2:
        return 0.0
    basis = orthonormal(np.concatenate([visible.added, *(one.columns for one in others)], axis=1))
    left = without(basis, visible.residual[:, None])[:, 0]
    rows = without(basis, candidate.columns).T
    lengths = np.sqrt(np.einsum("km,km->k", rows, rows))
    lengths = np.where(lengths == 0, 1.0, lengths)
    scaled = rows / lengths[:, None]
    common, rank, _ = _explained(scaled @ scaled.T, scaled @ left)
    places = np.arange(len(rows))[None]
    each, ranks = _run_by_run(rows.reshape(len(rows), runs, -1), left.reshape(runs, -1), lengths, places)
    between, more = float(each[0] - common), int(ranks[0]) - int(rank)
    stays, dof = float(left @ left - each[0]), visible.degrees_of_freedom - basis.shape[1] - int(ranks[0])
    if more < 1 or dof < 1 or between <= 0 or stays <= 0:
        return 0.0
    if special.fdtrc(more, dof, (between / more) / (stays / dof)) > SCATTERS:
        return 0.0
    return float(special.fdtrc(int(rank), more, (float(common) / int(rank)) / (between / more)))
