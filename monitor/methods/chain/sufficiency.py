"""Whether a run suffices: the joints that stood still in it, and what its readings leave over beside the unknowns."""

from __future__ import annotations

import numpy as np

from monitor.exceptions import TooFewReadingsError
from monitor.machine import Joint
from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.problem import ChainProblem


def still_joints(problem: ChainProblem, run: int, *kinds: str) -> list[Joint]:
    """The joints of these kinds (of any where none is named) that had one position in all rows of a run."""
    rows = problem.context.run == run
    return [
        joint
        for index, joint in enumerate(problem.context.chain.joints)
        if (not kinds or joint.kind in kinds) and np.ptp(problem.context.positions[rows, index]) == 0
    ]


def refuse_exact_fits(problem: ChainProblem, solution: Solution) -> None:
    """Raise TooFewReadingsError where a run, or all together, determine as many unknowns as they have
    readings and calibrated numbers.

    What a run does not determine takes none of its numbers: it is named, and has none itself.
    """
    calibrated = len(problem.extra_names)
    numbers = [
        int(np.isfinite(problem.sigma[problem.context.run == run]).sum()) + calibrated for run in problem.runs
    ]
    for run, of_run, rank in zip(problem.runs, numbers, solution.rank, strict=True):
        _refuse_nothing_left(f"run {run}", of_run, int(rank))
    _refuse_nothing_left("the campaign", sum(numbers), int(solution.rank.sum() + solution.common_free.sum()))


def _refuse_nothing_left(whose: str, numbers: int, determined: int) -> None:
    if numbers <= determined:
        raise TooFewReadingsError(
            f"the {numbers} readings of {whose} determine as many unknowns of the model: nothing is left over to judge "
            "it by; measure more poses"
        )
