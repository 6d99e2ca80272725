"""The results of a solved problem: the numbers of every run, and what the plan cannot separate."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from monitor.methods.chain.common_parts import common_parts
from monitor.methods.chain.gross import GrossReading
from monitor.methods.chain.identification import Identification, RunIdentification
from monitor.methods.chain.least_squares import MEMBER_SHARE, Solution
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.chain.shared_effects import followed_effects, shared_parameters
from monitor.methods.model import Model
from monitor.records import Array, Campaign
from monitor.refusal import Advice, Reason, ReasonKind, Refusal

#: What a plan would have to do for parameters that one run cannot separate: problem, parameters and run to advice.
AdviceOf = Callable[[ChainProblem, tuple[str, ...], int], Advice]


def _groups(null_space: Array, names: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Unknowns that trade against each other: the blocks of the projector on the null space."""
    projector = null_space.T @ null_space
    # The same members as Solution.local_free refuses, so that no parameter stays without a number unnamed.
    member = np.abs(null_space).max(axis=0) >= MEMBER_SHARE
    size = np.sqrt(np.maximum(np.diag(projector), np.finfo(float).tiny))
    linked = (np.abs(projector) > MEMBER_SHARE * np.outer(size, size)) & np.outer(member, member)
    remaining = [int(column) for column in np.flatnonzero(member)]
    groups = []
    while remaining:
        group, front = {remaining[0]}, [remaining[0]]
        while front:
            column = front.pop()
            for other in np.flatnonzero(linked[column]):
                if int(other) not in group:
                    group.add(int(other))
                    front.append(int(other))
        remaining = [column for column in remaining if column not in group]
        groups.append(tuple(names[column] for column in sorted(group)))
    return groups


def refusals(problem: ChainProblem, null_space: Array, run: int, advice: AdviceOf) -> tuple[Refusal, ...]:
    """What one run cannot separate, by its null space, the reported parameters first, and why."""
    reported = problem.base_names
    refused = []
    for group in _groups(null_space, problem.local_names):
        inside = tuple(name for name in group if name in reported)
        if not inside:
            continue
        others = tuple(name for name in group if name not in inside)
        reason = Reason(ReasonKind.NOT_SEPARATED, others, advice(problem, inside, run))
        refused.append(Refusal(inside, reason))
    return tuple(refused)


def identification(
    campaign: Campaign,
    model: Model,
    problem: ChainProblem,
    solution: Solution,
    advice: AdviceOf,
    gross: tuple[GrossReading, ...],
) -> Identification:
    """The geometric errors of every run, with the covariance of the stated uncertainties."""
    count = len(problem.base_names)
    vectors = problem.vectors(solution.local, solution.common)
    spatial = problem.as_vectors(vectors)
    by_quantity = common_parts(problem, solution)
    runs = []
    for index, run in enumerate(problem.runs):
        rows = problem.context.run == run
        # A number that was not read has no weight and counts for nothing.
        residuals = vectors[rows][np.isfinite(problem.sigma[rows])]
        free = solution.local_free[index, :count]
        both = free[:, None] & free
        weighted = solution.last.residual[index]
        runs.append(
            RunIdentification(
                run=int(run),
                estimate=np.where(free, solution.local[index, :count], np.nan),
                covariance=np.where(both, solution.local_covariance[index, :count, :count], np.nan),
                unknowns=dict(
                    zip(problem.local_names[count:], map(float, solution.local[index, count:]), strict=True)
                ),
                refused=refusals(problem, solution.null_space[index], int(run), advice),
                residuals=spatial[rows],
                rms=float(np.sqrt(np.mean(residuals**2))),
                chi_square=float(weighted @ weighted),
                degrees_of_freedom=residuals.size + len(problem.extra_names) - int(solution.rank[index]),
                displaced=problem.displaced(solution.local[index]),
                common_parts={quantity: parts[index] for quantity, parts in by_quantity.items()},
            )
        )
    shared = shared_parameters(problem, solution)
    return Identification(
        campaign=campaign.name,
        method=campaign.method,
        model=model.name,
        parameters=problem.base_names,
        units=tuple(problem.base_units[name] for name in problem.base_names),
        runs=tuple(runs),
        added=shared.names,
        added_units=shared.units,
        added_estimate=shared.estimate,
        added_covariance=shared.covariance,
        added_refused=shared.refused,
        iterations=solution.iterations,
        gross=gross,
        followed=followed_effects(problem, solution),
    )
