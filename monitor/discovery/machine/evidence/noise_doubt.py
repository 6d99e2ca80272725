"""Evidence with the correlation of neighbours as uncertain as few runs leave it.

Of two runs with noise that walks, a drift of a whole run is some six observations, and what correlation says of them is
estimated from no more: at the estimate alone every fiftieth such campaign had a false effect. The p-value is averaged
over the correlations of the grid here, each with the weight of its restricted likelihood, as a prior that prefers none
would have it (the posterior predictive p-value of Meng, Ann. Statist. 22 (1994) 1142).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import scipy

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.scene_columns import columns_of
from monitor.discovery.search.projection import orthonormal, without
from monitor.records import Array

# So many correlations hold nearly all of the weight; where hundreds share it their p-values are alike.
MOST_CORRELATIONS = 24
# Below this part of the largest weight a correlation says nothing: the smallest p-value that is asked for is 1e-5.
SMALLEST_WEIGHT = 1e-3


class NoiseDoubt:
    """What other correlations than the estimated one would make of effects of a scene with correlated noise."""

    def __init__(self, scene: ChainScene) -> None:
        self._scene = scene

    @cached_property
    def _fits(self) -> list[tuple[float, Fit]]:
        """The weight of every correlation that the residuals allow, and the fit with it."""
        fit = self._scene.fit
        stated = None if fit.whitening is None else fit.whitening.correlation
        design = fit.noise_design_under(stated, whole=False)
        likelihoods = design.likelihoods(fit.solution.last.residual)
        best = sorted(likelihoods, key=lambda each: -each[1])[:MOST_CORRELATIONS]
        likely = [each for each in best if each[1] >= SMALLEST_WEIGHT * best[0][1]]
        total = sum(weight for _, weight in likely)
        return [(weight / total, fit.with_correlation(correlation)) for correlation, weight in likely]

    def p_value(self, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> float:
        """Return the mean p-value of an effect beside others over the correlations, its searched values not counted."""
        return float(sum(weight * _p_value(fit, others, candidate) for weight, fit in self._fits))


def _p_value(fit: Fit, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> float:
    """The p-value of F of an effect beside others under the noise of a fit."""
    designs = [each.columns.T for each in columns_of(fit, [effect.basis for effect in (*others, candidate)])]
    basis = orthonormal(np.concatenate([fit.nuisance.shared, *designs[:-1]], axis=1))
    residual: Array = without(basis, fit.white.reshape(-1, 1))[:, 0]
    columns = orthonormal(without(basis, designs[-1]))
    rank = columns.shape[1]
    freedom = fit.degrees_of_freedom + fit.nuisance.shared_rank - basis.shape[1] - rank
    explained = float(np.sum((columns.T @ residual) ** 2))
    rest = float(residual @ residual) - explained
    if rank == 0 or freedom < 1 or rest <= 0.0:
        return 1.0
    return float(scipy.special.fdtrc(rank, freedom, explained / rank / (rest / freedom)))
