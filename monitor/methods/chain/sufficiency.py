"""Whether a run suffices: the joints that stood still in it, and its readings against its unknowns."""

from __future__ import annotations

import numpy as np

from monitor.machine import Joint
from monitor.methods.chain.problem import ChainProblem


def still_joints(problem: ChainProblem, run: int, *kinds: str) -> list[Joint]:
    """The joints of these kinds (of any where none is named) that had one position in all rows of a run."""
    rows = problem.context.run == run
    return [
        joint
        for index, joint in enumerate(problem.context.chain.joints)
        if (not kinds or joint.kind in kinds) and np.ptp(problem.context.positions[rows, index]) == 0
    ]


def unknowns_of_run(problem: ChainProblem, run: int) -> int:
    """How many unknowns a run has: three coordinates of a target that it left out are none of it."""
    targets = np.unique(problem.context.target[problem.context.run == run])
    return len(problem.local_names) - 3 * (len(problem.targets) - len(targets))
