"""Whether a finding of a scan of a chain is believed: with every pose as one observation, against how its size
scatters from run to run, and by the error on runs that took no part in its fit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from monitor.discovery.machine.flexible import FlexibleErrors, error_of
from monitor.discovery.machine.poses import p_value_by_poses, poses_of_rows
from monitor.discovery.machine.refine import refine
from monitor.discovery.machine.run_evidence import p_value_against_runs
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.variants import with_drivers
from monitor.discovery.search.acceptance import Acceptance, lowers_held_out_error
from monitor.discovery.search.amplitudes import amplitudes
from monitor.discovery.search.evidence import BEYOND, STANDS_OUT, Evidence, Pool
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.scene import family_count
from monitor.discovery.search.sign_flips import p_value_by_flips
from monitor.records import Array


class ChainAcceptance(Acceptance[ChainCandidate]):
    """The rules of a search on a chain; ``drivers`` are those that the recorded columns allow."""

    def __init__(self, scene: ChainScene, drivers: Sequence[str], rate: float) -> None:
        self.scene = scene
        self.drivers = drivers
        self.rate = rate
        self._families = family_count(scene)
        self._poses = poses_of_rows(scene.fit)
        self._flexible = FlexibleErrors(scene, drivers)
        self._latest: tuple[object, Array, Array, tuple[ChainCandidate, ...]] | None = None

    def accepts(self, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> bool:
        """Whether an effect stands out with every pose as one observation and from how its size scatters from run to
        run, is of a plausible size, and lowers the error on runs left out (blocks of poses where there is one run; true
        where it has few) and that at poses left out of every run."""
        limit = self.rate
        if not self._survives(others, candidate) or not self._is_plausible(others, candidate):
            return False
        if self._poses is not None:
            by_poses = p_value_by_poses(candidate, self.scene, others, self._poses)
            if by_poses * self._families > limit:
                return False
        if p_value_against_runs(candidate, self.scene, others) * self._families > limit:
            return False
        return lowers_held_out_error(self.scene, others, candidate) and self._predicts_poses(
            others, candidate
        )

    def _survives(self, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> bool:
        """Whether an effect stands out beside the errors of others in whatever shape they have."""
        named = [other for other in others if error_of(other) != error_of(candidate)]
        if not named:
            return True
        basis, residual = self._beside(others, named)
        columns = orthonormal(without(basis, candidate.columns))
        explained = float(np.sum((columns.T @ residual) ** 2))
        size = columns.shape[1]
        dof = self.scene.degrees_of_freedom - basis.shape[1] - size
        rest = float(residual @ residual) - explained
        if size == 0 or dof < 1 or rest <= 0.0:
            return False
        p_value = float(scipy.special.fdtrc(size, dof, explained / size / (rest / dof)))
        return p_value * candidate.variant.tries * candidate.variant.odds * self._families <= self.rate

    def _beside(
        self, others: Sequence[ChainCandidate], named: Sequence[ChainCandidate]
    ) -> tuple[Array, Array]:
        """The span (M, r) of others, ``named`` ones in any shape, and the residual (M,) without it."""
        key = (tuple(id(other) for other in others), tuple(id(other) for other in named))
        if self._latest is None or self._latest[0] != key:
            columns = np.concatenate([self.scene.columns(others), self._flexible.columns(named)], axis=1)
            basis = orthonormal(columns)
            residual = without(basis, self.scene.residual[:, None])[:, 0]
            # The others are kept too: an identity is only that of an object that exists.
            self._latest = (key, basis, residual, (*others, *named))
        return self._latest[1], self._latest[2]

    def _is_plausible(self, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> bool:
        """Whether an effect beside others is no larger than a machine could have."""
        size = candidate.columns.shape[1]
        fitted = amplitudes(self.scene, [*others, candidate])
        sizes, spread = fitted.estimate[-size:], np.sqrt(np.diag(fitted.covariance)[-size:])
        sure = np.maximum(np.abs(sizes) - STANDS_OUT * spread, 0.0)
        return float(np.linalg.norm(sure)) <= BEYOND * candidate.largest

    def _predicts_poses(self, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> bool:
        """Whether an effect beside others lowers the error at poses left out of every run; true where there are too
        few poses."""
        columns = self.scene.columns(others)
        before = self.scene.held_out_error_by_poses(columns)
        after = self.scene.held_out_error_by_poses(np.concatenate([columns, candidate.columns], axis=1))
        return before is None or after is None or after < before

    def stands_among(
        self, pool: Pool[ChainCandidate], others: Sequence[ChainCandidate], evidence: Evidence[ChainCandidate]
    ) -> bool:
        """Whether an effect stands out under sign flips of whole runs, where there are enough of them."""
        p_value = p_value_by_flips(self.scene, pool, others, evidence, self.scene.run)
        return p_value is None or p_value <= self.rate

    def alternatives(self, candidate: ChainCandidate) -> Sequence[ChainCandidate]:
        """The effect with each driver, or without its own."""
        return scene_of(self.scene.fit, with_drivers(candidate.effect, self.drivers)).candidates

    def at_best_value(self, selected: Sequence[ChainCandidate], index: int) -> ChainCandidate:
        """The selected candidate at an index with its time constant, pitch or order at the best value."""
        return refine(self.scene, selected, index).candidate
