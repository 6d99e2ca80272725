"""Distances between effects under a plan, in standard deviations, and the poses that increase them most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from monitor.discovery.search.candidate import SMALLEST_SHARE
from monitor.methods.chain.least_squares import RANK_TOLERANCE
from monitor.records import Array

MOST_POSES = 3
# A decision with five standard deviations is as good as certain.
DECIDES = 5.0
# Poses that bring less than half as much again are not worth the time.
WORTHWHILE = 1.5
RIDGE = 1e-10


@dataclass(frozen=True)
class PlanRows:
    """Whitened rows of a plan: ``nuisance`` (..., p), everything that is free, and columns (..., k) of each effect."""

    nuisance: Array
    effects: Sequence[Array]


@dataclass(frozen=True)
class Pair:
    """Two effects: products (q, q) of [everything free, the second effect, the first one at its size] over the
    present plan of one run, and what every pose adds to them (P, q, q)."""

    effects: tuple[int, int]
    present: Array
    additions: Array


@dataclass(frozen=True)
class Selection:
    """Indices of the selected poses, standard deviations between the closest pair before and after, and pairs that no
    pose separates."""

    poses: tuple[int, ...]
    before: float
    after: float
    alike: tuple[tuple[int, int], ...]


def pairs_of(
    present: PlanRows, new: PlanRows, pose: npt.NDArray[np.int64], coefficients: Array
) -> list[Pair]:
    """All pairs of a group whose first effect has the given coefficients, the others those that mimic it best."""
    sizes = [coefficients]
    wanted = present.effects[0] @ coefficients
    for columns in present.effects[1:]:
        both = np.concatenate([columns, present.nuisance], axis=1)
        scale = np.linalg.norm(both, axis=0)
        scale[scale == 0] = 1.0
        mimic = np.linalg.lstsq(both / scale, wanted, rcond=1e-6)[0] / scale
        sizes.append(mimic[: columns.shape[1]])
    starts = np.searchsorted(pose, np.unique(pose))
    pairs = []
    for first, second in combinations(range(len(sizes)), 2):
        # What the present plan does not see of the first effect may have any size.
        unseen = _unseen(present.nuisance, present.effects[first])
        whole, fresh = (
            np.concatenate(
                [
                    rows.nuisance,
                    rows.effects[second],
                    rows.effects[first] @ unseen,
                    (rows.effects[first] @ sizes[first])[..., None],
                ],
                axis=-1,
            )
            for rows in (present, new)
        )
        scale = np.sqrt(np.sum(whole**2, axis=0) + np.mean(np.sum(fresh**2, axis=1), axis=0))
        scale[-1] = 1.0
        scale[scale == 0] = 1.0
        whole, fresh = whole / scale, fresh / scale
        each = np.swapaxes(fresh, 1, 2) @ fresh
        pairs.append(Pair((first, second), whole.T @ whole, np.add.reduceat(each, starts, axis=0)))
    return pairs


def _unseen(nuisance: Array, columns: Array) -> Array:
    """Directions (k, u) of an effect's coefficients of which the nuisance leaves nothing."""
    scale = np.linalg.norm(nuisance, axis=0)
    basis, values, _ = np.linalg.svd(nuisance / np.where(scale == 0, 1.0, scale), full_matrices=False)
    basis = basis[:, values > RANK_TOLERANCE * values.max(initial=0.0)]
    remainder = columns - basis @ (basis.T @ columns)
    size = max(float(np.linalg.norm(columns, axis=0).max(initial=0.0)), 1e-300)
    values, directions = np.linalg.eigh(remainder.T @ remainder / size**2)
    hidden: Array = directions[:, values <= SMALLEST_SHARE**2]
    return hidden


def select_poses(pairs: Sequence[Pair], runs: int, measured: npt.NDArray[np.bool_]) -> Selection:
    """Select the poses, one after the other, that separate the closest pair most over a number of runs; none twice and
    none that is ``measured`` (P,) already, since those are more runs and no other poses."""
    close = [pair for pair in pairs if distance_of(pair.present, runs) <= DECIDES]
    separable = [pair for pair in close if _is_separable(pair, runs)]
    alike = tuple(pair.effects for pair in close if not _is_separable(pair, runs))
    if not separable:
        return _without_poses(pairs, runs, alike)
    grams = [pair.present for pair in separable]
    before = after = min(distance_of(gram, runs) for gram in grams)
    selected: list[int] = []
    is_open = ~measured
    for _ in range(min(MOST_POSES, int(is_open.sum()))):
        each = [_distances(gram + pair.additions, runs) for gram, pair in zip(grams, separable, strict=True)]
        # The pair that is closest counts; what lies far enough apart already does not.
        closest = np.min(np.minimum(each, 2.0 * DECIDES), axis=0)
        gained = closest + 1e-9 * np.sum(np.minimum(each, 1e3 * DECIDES), axis=0)
        best = int(np.where(is_open, gained, -1.0).argmax())
        is_open[best] = False
        selected.append(best)
        grams = [gram + pair.additions[best] for gram, pair in zip(grams, separable, strict=True)]
        after = min(float(distances[best]) for distances in each)
        if after > 2.0 * DECIDES:
            break
    decides = after >= DECIDES and after >= WORTHWHILE * before
    return Selection(tuple(selected) if decides else (), before, after, alike)


def _without_poses(pairs: Sequence[Pair], runs: int, alike: tuple[tuple[int, int], ...]) -> Selection:
    """No poses, and how far apart the closest pair is."""
    closest = min((distance_of(pair.present, runs) for pair in pairs), default=0.0)
    return Selection((), closest, closest, alike)


def _is_separable(pair: Pair, runs: int) -> bool:
    """Whether all poses together separate a pair."""
    best = distance_of(pair.present + pair.additions.sum(axis=0), runs)
    return best >= DECIDES and best >= WORTHWHILE * distance_of(pair.present, runs)


def distance_of(gram: Array, runs: int) -> float:
    """Standard deviations between a pair over all runs, for its Gram matrix (q, q)."""
    return float(_distances(gram[None], runs)[0])


def _distances(grams: Array, runs: int) -> Array:
    """Standard deviations (P,) between a pair over all runs, for every Gram matrix (P, q, q): the length of what of the
    last column the others cannot do."""
    inner = grams[:, :-1, :-1] + RIDGE * np.eye(grams.shape[-1] - 1)
    onto = grams[:, :-1, -1:]
    solved = np.linalg.solve(inner, onto)
    squares = np.maximum(grams[:, -1, -1] - np.einsum("pij,pij->p", onto, solved), 0.0)
    return np.asarray(np.sqrt(runs * squares))
