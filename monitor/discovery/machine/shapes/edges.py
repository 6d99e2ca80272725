"""What has edges of one error, teeth or steps, asked for only where it may be worth as much as what was found.

To find the places of steps and the pitch and edge of a sawtooth takes longest of all shapes. What they say at most is
known before: what a rough search explains, with what may stay beside them, and a leeway for what a fine one finds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.shapes.free_parts import most_together, priced
from monitor.discovery.machine.shapes.scale_steps import StepsOfError, steps_of
from monitor.discovery.machine.shapes.teeth import TeethOfError, teeth_of
from monitor.discovery.search.evidence import weigh_beside

# Of 1 422 sawtooths and 611 steps of 25 simulated campaigns none had a score higher by more than 59 beyond twice that
# of the rough one, or by more than 8 and a fifteenth of it (docs/benchmarks.md).
LEEWAY_OF_STEPS, PART_OF_STEPS, LEEWAY_OF_TEETH = 20.0, 0.1, 80.0


@dataclass(frozen=True)
class Edges:
    """The teeth and the steps of one error, None where it has none."""

    scene: ChainScene
    teeth: TeethOfError | None
    steps: StepsOfError | None

    def beside(
        self,
        leading: Sequence[ChainCandidate],
        may_stay: Sequence[ChainCandidate],
        worth: float,
        *,
        with_steps: bool,
    ) -> list[list[ChainCandidate]]:
        """The teeth and, if asked for, the steps that say most beside leading effects, as far as there are any that
        with these and with what ``may_stay`` may have a score above ``worth``."""
        asked: list[list[ChainCandidate]] = []
        if self.teeth is not None and self._teeth_may(self.teeth, leading, may_stay, worth):
            asked.append(self.teeth.beside(leading))
        if self.steps is not None and with_steps and self._steps_may(self.steps, leading, may_stay, worth):
            asked.append(self.steps.beside(leading))
        return [some for some in asked if some]

    def _teeth_may(
        self,
        teeth: TeethOfError,
        leading: Sequence[ChainCandidate],
        may_stay: Sequence[ChainCandidate],
        worth: float,
    ) -> bool:
        """Whether the sawtooth of the grid or the plain cycle that says most, once more, may be worth it."""
        return any(
            most_together(self.scene, rough.candidate, leading, may_stay) + rough.score + LEEWAY_OF_TEETH
            > worth
            for rough in weigh_beside(self.scene, teeth.rough(leading), leading)
        )

    def _steps_may(
        self,
        steps: StepsOfError,
        leading: Sequence[ChainCandidate],
        may_stay: Sequence[ChainCandidate],
        worth: float,
    ) -> bool:
        """Whether many steps at once, powers and plays, each at the price of a coefficient, may be worth it."""
        rough = steps.rough(leading)
        if rough is None:
            return False
        freedom = self.scene.remainders.beside(leading).degrees_of_freedom
        price = (rough.columns.shape[1] - 1) * float(np.log(freedom)) + steps.price(1, leading)
        alone, most = (most_together(self.scene, rough, leading, some) - price for some in ([], may_stay))
        leeway = LEEWAY_OF_STEPS + PART_OF_STEPS * max(alone - priced(self.scene, leading), 0.0)
        return bool(most + leeway > worth)


def edges_of(scene: ChainScene, shape: ChainCandidate) -> Edges:
    """What has edges of the error of which a candidate is a shape."""
    return Edges(scene, teeth_of(scene, shape), steps_of(scene, shape))
