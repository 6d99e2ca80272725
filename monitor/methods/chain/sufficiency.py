"""Whether a run suffices: the joints that stood still in it, and what its readings leave over beside the unknowns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from monitor.exceptions import TooFewReadingsError
from monitor.machine import Joint
from monitor.methods.chain.least_squares import COMMON_RANK_TOLERANCE, RANK_TOLERANCE, Solution
from monitor.methods.chain.problem import ChainProblem


@dataclass(frozen=True)
class OpenUnknowns:
    """How many unknowns of a run its plan leaves open: ``count`` in all, and of these those that a
    fit takes for determined all the same (``for_a_fit``): it turns small readings into metres there."""

    count: int
    for_a_fit: int


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

    What a run does not determine takes none of its numbers: it is named, and has none itself. Where other runs have
    more, those that have not, such as one that was broken off, are all named: without them the others are answered.
    """
    calibrated = len(problem.extra_names)
    readings = readings_of_runs(problem)
    numbers = [of_run + calibrated for of_run in readings.values()]
    exact = {
        run: of_run
        for (run, of_run), rank in zip(readings.items(), solution.rank, strict=True)
        if of_run + calibrated <= rank
    }
    for run, of_run in exact.items():
        _refuse(f"run {run}", of_run, exact if len(exact) < len(numbers) else {})
    if sum(numbers) <= int(solution.rank.sum() + solution.common_free.sum()):
        _refuse("the campaign", sum(numbers), {})


def readings_of_runs(problem: ChainProblem) -> dict[int, int]:
    """The numbers with weight that were read in each run, by its number."""
    return {
        int(run): int(np.isfinite(problem.sigma[problem.context.run == run]).sum()) for run in problem.runs
    }


def open_at_start(problem: ChainProblem) -> list[OpenUnknowns]:
    """What the plan of each run leaves open, by the derivatives at the first guess."""
    begin, common = problem.start, problem.common_start
    of_runs = (problem.condensed if problem.is_in_parts else problem.linearise)(begin, common).local
    scale = np.linalg.norm(of_runs, axis=1, keepdims=True)
    singular = np.linalg.svd(of_runs / np.where(scale == 0.0, 1.0, scale), compute_uv=False)
    relative = singular / np.where(singular[:, :1] == 0.0, 1.0, singular[:, :1])
    determined, for_a_fit = (
        (relative > limit).sum(axis=1) for limit in (COMMON_RANK_TOLERANCE, RANK_TOLERANCE)
    )
    unknowns = of_runs.shape[2]
    return [
        OpenUnknowns(unknowns - int(a), int(b) - int(a)) for a, b in zip(determined, for_a_fit, strict=True)
    ]


def _refuse(whose: str, numbers: int, without: Mapping[int, int]) -> NoReturn:
    """Raise that nothing is left over, and which runs the campaign is answered ``without``; none where no other is."""
    listed = f"; or leave run{'s' * (len(without) > 1)} {', '.join(map(str, without))} out"
    raise TooFewReadingsError(
        f"the {numbers} readings of {whose} determine as many unknowns of the model: nothing is left over to judge it "
        f"by; measure more poses{listed if without else ''}",
        without,
    )
