"""Runs whose plan leaves unknowns open, such as one that was broken off: where no fit holds, they may be why."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np

from monitor.exceptions import MonitorError, TooFewReadingsError
from monitor.methods.chain.problem import ChainProblem, solve_problem
from monitor.methods.chain.sufficiency import OpenUnknowns, open_at_start, readings_of_runs, still_joints
from monitor.readers.doubts.unit_doubts import runs_in_units
from monitor.records import Campaign
from monitor.reporting.run_left_out import poor_runs_refused, poses_too_few, stands_still
from monitor.workflow.campaign_parts import without_runs

#: A run with this part of the readings of the longest is no run that was broken off, if its axes move by this part of
#: what they move by in the others: of 62 rows 6 may be missing; random poses of a robot spread so unequally in runs.
NEARLY_ALL, AS_WIDE = 0.9, 0.8


def refusal_of_poor_runs(
    campaign: Campaign, problem_of: Callable[[Campaign], ChainProblem]
) -> TooFewReadingsError | None:
    """The refusal of a campaign that no machine of the file fits because of runs whose plan leaves unknowns open that
    other runs determine, by the derivatives at the first guess; None where it fits without them no better, or where
    one of them has as many readings as any, or is whole but for an axis that stands still in it alone: there is no rest
    of its poses to measure."""
    problem, open_unknowns, readings = _at_start(campaign, problem_of)
    poor = _beyond_others(open_unknowns, readings)
    if problem is None or not poor or max(readings[run] for run in poor) == max(readings.values()):
        return None
    if any(_still_alone(problem, run, readings) for run in poor):
        return None
    if {odd.run for odd in runs_in_units(campaign)} & set(poor):
        return None
    if not _fits(campaign, poor, problem_of):
        return None
    of_poor = {run: readings[run] for run in poor}
    return TooFewReadingsError(poor_runs_refused(of_poor, poor), of_poor, poor)


def standing_still(campaign: Campaign, problem_of: Callable[[Campaign], ChainProblem]) -> tuple[str, ...]:
    """A sentence for each run with as many readings as any, or nearly, that leaves unknowns open which others
    determine, with the axes that stand still in it alone."""
    problem, open_unknowns, readings = _at_start(campaign, problem_of)
    if problem is None:
        return ()
    still_in = {run: _still_alone(problem, run, readings) for run in _beyond_others(open_unknowns, readings)}
    return tuple(stands_still(run, still) for run, still in still_in.items() if still)


def _still_alone(problem: ChainProblem, run: int, readings: Mapping[int, int]) -> list[str]:
    """The axes that stand still in a run and move in all others, where the poses of the others are whole in it: none of
    one that was broken off."""
    others = set(readings) - {run}
    still = {joint.name for joint in still_joints(problem, run)}
    for other in others:
        still -= {joint.name for joint in still_joints(problem, other)}
    most = max(readings.values())
    if readings[run] == most:
        return sorted(still)
    if readings[run] < NEARLY_ALL * most:
        return []
    context = problem.context
    positions = context.positions[context.run == run]
    for index, joint in enumerate(context.chain.joints):
        of_others = [context.positions[context.run == other, index] for other in others]
        if joint.name in still:
            # An axis that moves in the others only behind the place where this run ends was broken off before it did.
            if not any(np.ptp(of_other[: len(positions)]) > 0.0 for of_other in of_others):
                still.remove(joint.name)
        elif np.ptp(positions[:, index]) < AS_WIDE * np.median([np.ptp(of_other) for of_other in of_others]):
            return []
    return sorted(still)


def _beyond_others(open_unknowns: Sequence[OpenUnknowns], readings: Mapping[int, int]) -> dict[int, int]:
    """How many unknowns each run leaves open that other runs determine, of those that leave any."""
    fewest = min((each.count for each in open_unknowns), default=0)
    return {
        run: each.count - fewest
        for run, each in zip(readings, open_unknowns, strict=True)
        if each.count > fewest
    }


def hardly_told(campaign: Campaign, problem_of: Callable[[Campaign], ChainProblem]) -> tuple[str, ...]:
    """A sentence on plans that are all alike and hardly tell some unknowns from others, so that a fit may lose itself
    though the file is right; none where the plans tell them."""
    _, open_unknowns, readings = _at_start(campaign, problem_of)
    hardly = min((each.for_a_fit for each in open_unknowns), default=0)
    if hardly == 0:
        return ()
    return (poses_too_few(next(iter(readings)) if len(readings) == 1 else None, hardly),)


def _at_start(
    campaign: Campaign, problem_of: Callable[[Campaign], ChainProblem]
) -> tuple[ChainProblem | None, list[OpenUnknowns], dict[int, int]]:
    """The problem of a campaign, what the plan of each run leaves open, and its readings; nothing of a campaign that is
    no problem."""
    try:
        problem = problem_of(campaign)
    except MonitorError:
        return None, [], {}
    return problem, open_at_start(problem), readings_of_runs(problem)


def _fits(
    campaign: Campaign, without: Collection[int], problem_of: Callable[[Campaign], ChainProblem]
) -> bool:
    """Whether a machine of the file fits a campaign without some runs."""
    try:
        with np.errstate(all="ignore"):
            solve_problem(problem_of(without_runs(campaign, without)))
    except (MonitorError, np.linalg.LinAlgError):
        return False
    return True
