"""Whether a finding of a scan of a chain is believed: with every pose as one observation, against how its size
scatters from run to run, and by the error on runs that took no part in its fit.
"""

from __future__ import annotations

from collections.abc import Sequence

from monitor.discovery.machine.poses import p_value_by_poses, poses_of_rows
from monitor.discovery.machine.refine import refine
from monitor.discovery.machine.run_evidence import p_value_against_runs
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.variants import with_drivers
from monitor.discovery.search.acceptance import Acceptance, lowers_held_out_error
from monitor.discovery.search.evidence import Evidence, Pool
from monitor.discovery.search.scene import family_count
from monitor.discovery.search.sign_flips import p_value_by_flips


class ChainAcceptance(Acceptance[ChainCandidate]):
    """The rules of a search on a chain; ``drivers`` are those that the recorded columns allow."""

    def __init__(self, scene: ChainScene, drivers: Sequence[str], rate: float) -> None:
        self.scene = scene
        self.drivers = drivers
        self.rate = rate
        self._families = family_count(scene)
        self._poses = poses_of_rows(scene.fit)

    def accepts(self, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> bool:
        """Whether an effect stands out with every pose as one observation and from how its size scatters from run to
        run, and lowers the error on runs left out (blocks of poses where there is one run; true where it has few)."""
        limit = self.rate
        if self._poses is not None:
            by_poses = p_value_by_poses(candidate, self.scene, others, self._poses)
            if by_poses * self._families > limit:
                return False
        if p_value_against_runs(candidate, self.scene, others) * self._families > limit:
            return False
        return lowers_held_out_error(self.scene, others, candidate)

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
