"""Evidence with the correlation of neighbours as uncertain as few runs leave it.

Of two runs with noise that walks, a drift of a whole run is some six observations, and what correlation says of them is
estimated from no more: at the estimate alone every fiftieth such campaign had a false effect. The p-value is averaged
over the correlations of the grid here, each with the weight of its restricted likelihood, as a prior that prefers none
would have it (the posterior predictive p-value of Meng, Ann. Statist. 22 (1994) 1142).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.scene_columns import columns_of
from monitor.discovery.search.memory import Memory
from monitor.discovery.search.projection import orthonormal, without
from monitor.records import Array


class NoiseDoubt:
    """What other correlations than the estimated one would make of effects of a scene with correlated noise."""

    def __init__(self, scene: ChainScene) -> None:
        self._scene = scene
        self._columns: Memory[list[Array]] = Memory()

    def p_value(self, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> float:
        """Return the mean p-value of an effect beside others over the correlations, its searched values not counted."""
        noises = self._scene.fit.in_likely_noise
        designs = zip(*map(self._columns_of, (*others, candidate)), strict=True)
        return sum(
            weight * _p_value(fit, *columns) for (weight, fit), columns in zip(noises, designs, strict=True)
        )

    def _columns_of(self, candidate: ChainCandidate) -> list[Array]:
        """The columns (M, k) of an effect under each correlation: what is selected stands beside many."""
        noises = self._scene.fit.in_likely_noise
        return self._columns.answer(
            (), candidate, lambda: [columns_of(fit, [candidate.basis])[0].columns.T for _, fit in noises]
        )


def _p_value(fit: Fit, *columns: Array) -> float:
    """The p-value of F of the last columns beside the others under the noise of a fit."""
    basis = orthonormal(np.concatenate([fit.nuisance.shared, *columns[:-1]], axis=1))
    residual: Array = without(basis, fit.white.reshape(-1, 1))[:, 0]
    tested = orthonormal(without(basis, columns[-1]))
    rank = tested.shape[1]
    freedom = fit.degrees_of_freedom + fit.nuisance.shared_rank - basis.shape[1] - rank
    explained = float(np.sum((tested.T @ residual) ** 2))
    rest = float(residual @ residual) - explained
    if rank == 0 or freedom < 1 or rest <= 0.0:
        return 1.0
    return float(scipy.special.fdtrc(rank, freedom, explained / rank / (rest / freedom)))
