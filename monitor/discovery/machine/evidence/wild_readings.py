"""What effects leave of a residual where no wild reading counts for more than its score.

Sums of squares give one wild reading in noise with heavy tails the weight of hundreds: under sign flips too it is there
each time, with what the fit made of its neighbours, and the effect that takes most of it looks like none by chance. The
score of Student's t with the degrees of freedom that the numbers themselves show is bounded; the most that it reaches
is kept beyond, so that a large effect still says more than a small one (a monotone score: Huber, Ann. Math. Statist. 35
(1964) 73; Hampel et al., Robust statistics, 1986, section 7.3). The unknowns are determined anew under these scores.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.suspects.tails import Tails, tails_of
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.remainder import Remainder
from monitor.records import Array

# From so many degrees of freedom on (a kurtosis of 3.2) sums of squares say as much.
LIGHT = 30.0
# Scores and unknowns in turn: the unknowns still take at most 0.25 % of the scores then (60 campaigns of 1, 4 and 7
# runs with tails of Student 3).
STEPS = 10


def without_wild_readings(
    scene: ChainScene, others: Sequence[ChainCandidate], candidate: ChainCandidate
) -> Remainder | None:
    """Return what others leave as scores under the tails that a candidate beside them leaves; None where these are
    light."""
    beside = scene.remainders.beside(others)
    columns = orthonormal(without(beside.basis, candidate.columns))
    remaining = without(columns, beside.residual[:, None])
    # Padding and readings without weight leave nothing at all.
    tails = tails_of(remaining[beside.residual != 0.0])
    if tails.freedom >= LIGHT:
        return None
    numbers = beside.residual
    for _ in range(STEPS):
        numbers = numbers - _taken_up(scene, beside, _scores(tails, numbers))
    scores = _scores(tails, numbers)
    scores = scores - _taken_up(scene, beside, scores)
    return replace(beside, whole=scores, residual=scores)


def _scores(tails: Tails, numbers: Array) -> Array:
    """The scores (M,) of numbers under tails, beyond where they are largest as large as there."""
    largest = np.sqrt(tails.freedom * tails.variance)
    within = np.clip(numbers, -largest, largest)
    return tails.weights(within**2, 1) * within


def _taken_up(scene: ChainScene, beside: Remainder, scores: Array) -> Array:
    """The part of scores (M,) that is within what every run's own unknowns and the effects can do."""
    unknowns = scene.fit.nuisance.basis
    of_runs = scores.reshape(unknowns.shape[:2])
    taken = np.einsum("rnk,rk->rn", unknowns, np.einsum("rnk,rn->rk", unknowns, of_runs)).reshape(-1)
    return np.asarray(taken + beside.basis @ (beside.basis.T @ scores))
