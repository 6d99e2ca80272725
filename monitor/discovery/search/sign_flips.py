"""Sign flips of whole runs: how often noise alone would bring forth a candidate as convincing as one that was found.

Where nothing is missing the residual of a run is as likely as its negative, whatever the readings of one run share
with each other; of blocks of one run that holds as far as the correlation of neighbours was taken out. So the scores of
the runs (or blocks) are given random signs, and the most convincing of all candidates under these
signs is compared with the one that was found (Hemerik, Goeman and Finos, J. R. Stat. Soc. B 82 (2020) 841; the maximum
over all candidates as in Westfall and Young, Resampling-based multiple testing, 1993). That pays for every candidate
that was looked at, searched pitches and time constants too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from monitor.discovery.search.evidence import Evidence, Pool
from monitor.discovery.search.projection import eigen, orthonormal, without
from monitor.discovery.search.remainder import Remainder
from monitor.discovery.search.scene import CandidateT
from monitor.records import Array

# With 999 flips a p-value of 0.01 is known to 0.003.
FLIPS = 999
# So many runs or fewer have fewer than 128 different flips, which no effect can pass at 1 %. An effect that mainly few
# of the runs show (a warm-up in the first of each day) is as if there were only these. Seven runs that show the same
# are seven but for rounding.
FEWEST, ROUNDING = 7.0, 1e-6
# Up to so many runs all flips are made.
ALL_FLIPS_UP_TO = 10
# Candidates that are flipped together: 2 MB a coefficient, which stay in the cache of a core.
AT_ONCE = 250
# Draws the flips, always the same.
SEED = 20261122


@lru_cache(maxsize=8)
def signs(runs: int) -> Array:
    """Signs (R, G) of the flips, the first run's always +1; none of them is that of no flip at all."""
    if runs <= ALL_FLIPS_UP_TO:
        numbers = np.arange(1, 2 ** (runs - 1))
        flips = 1.0 - 2.0 * ((numbers[None, :] >> np.arange(runs)[:, None]) & 1)
        return np.concatenate([np.ones((1, len(numbers))), flips[:-1]])
    return np.asarray(np.random.default_rng(SEED).choice([-1.0, 1.0], size=(runs, FLIPS)))


def effective_number(columns: Array, unit: npt.NDArray[np.int64]) -> float:
    """By how many units (M,) orthonormal columns (M, k) are shown: as many as there are where each shows the same."""
    weights = np.bincount(unit, weights=np.sum(columns**2, axis=1))
    return float(weights.sum() ** 2 / max(float(weights @ weights), 1e-300))


def p_value_by_flips(
    beside: Remainder,
    pool: Pool[CandidateT],
    evidence: Evidence[CandidateT],
    units: Sequence[npt.NDArray[np.int64]],
) -> float | None:
    """Return the share of flips under which some candidate of a pool is as convincing as ``evidence`` in what other
    effects leave.

    ``units`` (M,) each are the indices, in order, of what every row is flipped with: runs, then blocks of them. The
    first by which enough of the effect is shown independently is taken; None where there is none.
    """
    basis, residual, dof = beside.basis, beside.residual, beside.degrees_of_freedom
    columns = orthonormal(without(basis, evidence.candidate.columns))
    run = next((unit for unit in units if effective_number(columns, unit) > FEWEST + ROUNDING), None)
    if run is None:
        return None
    runs = int(run[-1]) + 1
    total = float(residual @ residual)
    if dof < 1 or total <= 0.0:
        return 1.0
    ends = np.searchsorted(run, np.arange(runs + 1))
    overlap = pool.overlap(beside)
    scores = np.empty((len(pool.lengths), runs))
    for index, (start, end) in enumerate(pairwise(ends)):
        scores[:, index] = pool.products(residual[start:end], slice(start, end))
        scores[:, index] -= overlap @ (basis[start:end].T @ residual[start:end])
    scores /= pool.lengths[:, None]
    flips = signs(runs)
    beaten = np.zeros(flips.shape[1], dtype=bool)
    for members, rows, grams in _some_at_once(pool):
        part = overlap[rows] / pool.lengths[rows][..., None]
        gram = grams - part @ np.swapaxes(part, -1, -2)
        values, vectors = eigen(gram)
        keep = values > pool.least[members][:, None]
        price = keep.sum(axis=-1) * np.log(max(dof, 1)) + 2.0 * np.log(
            pool.tries[members] * pool.odds[members]
        )
        price += pool.behind[members]
        # The sum of squares from which on a candidate is as convincing as the one that was found.
        needed = total * -np.expm1(-(evidence.score + price) / dof)
        scaled = (
            np.swapaxes(vectors, -1, -2)
            * np.where(keep, 1.0 / np.sqrt(np.where(keep, values, 1.0)), 0.0)[..., None]
        )
        along = scaled @ scores[rows]
        # No signs make more of a candidate than the lengths of its scores one after the other.
        most = np.sum(np.sqrt(np.sum(along**2, axis=1)), axis=1) ** 2
        along, needed = (each[most >= (1.0 - ROUNDING) * needed] for each in (along, needed))
        flipped = (along.reshape(-1, runs) @ flips).reshape(*along.shape[:2], flips.shape[1])
        beaten |= np.any(np.sum(flipped**2, axis=1) >= needed[:, None], axis=0)
    return float((1 + int(beaten.sum())) / (1 + flips.shape[1]))


def _some_at_once(
    pool: Pool[CandidateT],
) -> Iterator[tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], Array]]:
    """Candidates (n,) of one size, their rows (n, k) and products (n, k, k): under all flips they are many numbers."""
    for size, (members, rows) in pool.by_size.items():
        for start in range(0, len(members), AT_ONCE):
            some = slice(start, start + AT_ONCE)
            yield members[some], rows[some], pool.grams[size][some]
