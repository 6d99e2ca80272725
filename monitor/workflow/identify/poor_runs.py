"""Runs whose plan leaves unknowns open, such as one that was broken off: where no fit holds, they may be why."""

from __future__ import annotations

from collections.abc import Callable, Collection

import numpy as np

from monitor.exceptions import MonitorError, TooFewReadingsError
from monitor.methods.chain.problem import ChainProblem, solve_problem
from monitor.methods.chain.sufficiency import open_at_start, readings_of_runs
from monitor.readers.doubts.unit_doubts import runs_in_units
from monitor.records import Campaign
from monitor.readers.faults import and_of
from monitor.workflow.campaign_parts import without_runs


def refusal_of_poor_runs(
    campaign: Campaign, problem_of: Callable[[Campaign], ChainProblem]
) -> TooFewReadingsError | None:
    """The refusal of a campaign that no machine of the file fits because of runs whose plan leaves unknowns open; None
    where it is not that.

    Decided by the derivatives at the first guess: of runs that determine less than others, by a fit without them; of
    runs all alike, by directions that neither stay open nor are determined, in which a fit loses itself.
    """
    try:
        problem = problem_of(campaign)
    except MonitorError:
        return None
    open_unknowns, hardly = open_at_start(problem)
    readings = readings_of_runs(problem)
    fewest = int(open_unknowns.min())
    poor = {
        run: int(count) - fewest for run, count in zip(readings, open_unknowns, strict=True) if count > fewest
    }
    if not poor:
        return _of_all(readings, int(hardly.max())) if hardly.any() else None
    if {odd.run for odd in runs_in_units(campaign)} & set(poor) or not _fits(campaign, poor, problem_of):
        return None
    each = [
        f"the {readings[run]} readings of run {run} leave {count} unknown{'s' * (count > 1)} of the model open"
        for run, count in poor.items()
    ]
    runs = f"run{'s' * (len(poor) > 1)} {', '.join(map(str, poor))}"
    return TooFewReadingsError(
        f"{and_of(each)} that the other runs determine, and no fit of all runs holds, without {runs} one does: "
        f"measure the rest of the poses of {runs}; or leave {runs} out",
        {run: readings[run] for run in poor},
        poor,
    )


def _of_all(readings: dict[int, int], hardly: int) -> TooFewReadingsError:
    whose = f"run {next(iter(readings))}" if len(readings) == 1 else "each run"
    return TooFewReadingsError(
        f"no fit converges: the poses of {whose} hardly tell {hardly} unknown{'s' * (hardly > 1)} of the model from "
        "others; measure more poses; where the plan tells them, check the axis signs, the topology, the order of the "
        "targets and the units"
    )


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
