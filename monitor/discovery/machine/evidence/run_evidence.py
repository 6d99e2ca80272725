"""Evidence from run to run: effects with another size in every run, and a common size against that scatter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import scipy

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.search.evidence import SMALLEST_REMAINDER, Evidence, Pool, evidence_of, explained_by
from monitor.discovery.search.projection import without
from monitor.records import Array

# Sizes of an effect scatter from run to run where noise alone would do so once in a thousand times.
SCATTERS = 1e-3


def _run_by_run(
    columns: Array, residual: Array, lengths: Array, rows: npt.NDArray[np.int64]
) -> tuple[Array, npt.NDArray[np.int64]]:
    """Sums of squares (n,) that candidates explain with another size in every run, and their ranks (n,).

    ``columns`` (K, R, N) and ``residual`` (R, N) are run by run, ``lengths`` (K,) of whole columns, ``rows``
    (n, k) of each candidate's columns.
    """
    length = np.sqrt(np.einsum("krm,krm->kr", columns, columns))
    # A run in which an effect leaves next to nothing says nothing of it.
    acts = length > np.sqrt(SMALLEST_REMAINDER) * lengths[:, None]
    scaled = np.where(acts[..., None], columns / np.where(acts, length, 1.0)[..., None], 0.0)
    onto = np.einsum("krm,rm->kr", scaled, residual)
    gram = np.einsum("nirm,njrm->nrij", scaled[rows], scaled[rows])
    squares, ranks, _ = explained_by(gram, np.swapaxes(onto[rows], 1, 2))
    return squares.sum(axis=-1), ranks.sum(axis=-1)


def weigh_in_each_run(
    candidates: Sequence[ChainCandidate], scene: ChainScene
) -> list[Evidence[ChainCandidate]]:
    """Weigh candidates by how their size scatters from run to run, given what the model has already.

    The effects already added are common to all runs; that they take part of the columns out is neglected here
    (one coefficient against one a run).
    """
    pool = Pool(tuple(candidates))
    if not pool.candidates:
        return []
    runs = len(np.unique(scene.run))
    columns, residual = pool.rows.reshape(len(pool.rows), runs, -1), scene.residual.reshape(runs, -1)
    explained = np.zeros(len(pool.candidates))
    rank = np.zeros(len(pool.candidates), dtype=np.int64)
    for members, rows in pool.by_size.values():
        each, ranks = _run_by_run(columns, residual, pool.lengths, rows)
        # What one size for all runs explains is no variation: it may be any effect that the model lacks.
        onto = (pool.rows @ scene.residual / pool.lengths)[rows]
        common, common_rank, _ = explained_by(pool.grams[rows.shape[1]], onto)
        explained[members] = np.maximum(each - common, 0.0)
        rank[members] = np.maximum(ranks - common_rank, 0)
    total = float(scene.residual @ scene.residual)
    likely = np.zeros(len(pool.candidates), dtype=bool)
    weighed = evidence_of(pool, np.minimum(explained, total), rank, (total, scene.degrees_of_freedom), likely)
    return sorted(weighed, key=lambda evidence: evidence.p_value)


def p_value_against_runs(
    candidate: ChainCandidate, scene: ChainScene, others: Sequence[ChainCandidate]
) -> float:
    """Return p-value of an effect's common size against how its size scatters from run to run, given others.

    Where the sizes of the runs scatter no more than noise does, the noise is the better yardstick: 0. Else each
    run is one observation, however many probings it has; with one run there is no such scatter: 0.
    """
    runs = len(np.unique(scene.run))
    if runs < 2:
        return 0.0
    beside = scene.remainders.beside(others)
    residual = beside.residual
    columns = without(beside.basis, candidate.columns).T
    lengths = np.sqrt(np.einsum("km,km->k", columns, columns))
    lengths = np.where(lengths == 0, 1.0, lengths)
    scaled = columns / lengths[:, None]
    common, rank, _ = explained_by(scaled @ scaled.T, scaled @ residual)
    rows = np.arange(len(columns))[None]
    each, ranks = _run_by_run(
        columns.reshape(len(columns), runs, -1), residual.reshape(runs, -1), lengths, rows
    )
    between, more = float(each[0] - common), int(ranks[0]) - int(rank)
    stays = float(residual @ residual - each[0])
    dof = beside.degrees_of_freedom - int(ranks[0])
    if more < 1 or dof < 1 or between <= 0 or stays <= 0:
        return 0.0
    if scipy.special.fdtrc(more, dof, (between / more) / (stays / dof)) > SCATTERS:
        return 0.0
    return float(scipy.special.fdtrc(int(rank), more, (float(common) / int(rank)) / (between / more)))
