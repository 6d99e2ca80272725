"""The contents of a campaign besides its probings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.effects.catalogue import drivers_of
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Campaign


@dataclass(frozen=True)
class Surroundings:
    """Folds, drivers and strokes of a campaign.

    ``runs`` and ``days`` (R,) are the fold of every run for held-out errors: itself, and its day; ``drivers`` are
    those that the recorded columns allow; ``strokes`` the positions in mm or rad that the strokes of the file allow.
    """

    runs: npt.NDArray[np.int64]
    days: npt.NDArray[np.int64]
    drivers: tuple[str, ...]
    strokes: Mapping[str, tuple[float, float]]


def surroundings_of(campaign: Campaign, problem: ChainProblem) -> Surroundings:
    """The surroundings of the runs of a problem."""
    days = {run.run: run.day for run in campaign.runs}
    strokes = {name: axis.stroke for name, axis in campaign.machine.axes.items()}
    return Surroundings(
        runs=np.arange(len(problem.runs)),
        days=np.array([days[int(run)] for run in problem.runs]),
        drivers=drivers_of(problem.context),
        strokes={
            joint.name: stroke if joint.sign > 0 else (-stroke[1], -stroke[0])
            for joint in problem.context.chain.joints
            if (stroke := strokes.get(joint.name)) is not None
        },
    )
