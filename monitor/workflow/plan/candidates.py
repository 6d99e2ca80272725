"""What could be probed: the balls and indexations that a machine and an artefact allow, and how long it takes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from monitor.discovery import fit
from monitor.methods import campaign_method
from monitor.methods.chain.touch import TouchProblem
from monitor.methods.planning.candidates import Candidates, Choice, TimeModel, more_balls, pose_grid
from monitor.methods.planning.touches import candidate_touches, planned_context
from monitor.records import Array, Campaign
from monitor.reporting.origins import TimeSource
from monitor.store import StoredModel
from monitor.workflow.models import as_model
from monitor.workflow.plan.strokes import strokes_of

# Where the times of a campaign do not tell: five touches of a ball take about a minute on a machining centre (the
# five-day campaign: 62 centres in 65 min), another indexation of two axes half of that.
ASSUMED_PROBING_S, ASSUMED_INDEXATION_S = 60.0, 30.0


@dataclass(frozen=True)
class PlannedCampaign:
    """What a campaign's machine and artefact allow: everything that could be touched, and the ``present`` plan, that
    of the first run. ``problem`` is one run, ``places`` (T, 3) mm are the nominal centres of the targets."""

    campaign: Campaign
    problem: TouchProblem
    candidates: Candidates
    present: Choice
    places: Array


def _time_model(problem: TouchProblem, pose: Array) -> TimeModel:
    """Seconds of the first run's own steps: within an indexation, and what a change of it adds."""
    steps = np.diff(problem.context.time)
    changed = np.diff(pose) != 0
    within, between = steps[~changed & (steps > 0)], steps[changed & (steps > 0)]
    if not len(within) or not len(between):
        return TimeModel(ASSUMED_PROBING_S, ASSUMED_INDEXATION_S, TimeSource.ASSUMED)
    probing = float(np.median(within))
    return TimeModel(probing, max(0.0, float(np.median(between)) - probing), TimeSource.CAMPAIGN)


def _with_identified_tip(problem: TouchProblem) -> TouchProblem:
    """The problem with the stylus tip where the campaign's own readings put it, as far as they determine it."""
    solution = fit(problem).solution
    tips = np.where(solution.local_free[:, -3:].all(axis=0), solution.local[:, -3:].mean(axis=0), problem.tip)
    x, y, z = map(float, tips)
    return replace(problem, tip=(x, y, z))


def _first_run(problem: TouchProblem) -> TouchProblem:
    """The problem of the first run alone."""
    context = problem.context
    first = context.run == problem.runs[0]
    planned = planned_context(
        context, context.positions[first], context.target[first].tolist(), context.nominal[first],
        np.zeros(int(first.sum()), dtype=np.int64),
    )  # fmt: skip
    return replace(
        problem,
        context=replace(planned, time=context.time[first]),
        sigma=problem.sigma[first],
        distances=tuple(replace(distance, length=distance.length[:1]) for distance in problem.distances),
        beside=None,
        read=None,
    )


def _indexations(problem: TouchProblem) -> tuple[Array, npt.NDArray[np.int64]]:
    """The different indexations (P, J) of a run, linear axes at zero, and that of every row (n,)."""
    context = problem.context
    turning = np.array([joint.turns for joint in context.chain.joints])
    rotary = np.round(np.where(turning, context.positions, 0.0), 6)
    poses, pose = np.unique(rotary, axis=0, return_inverse=True)
    return np.asarray(poses, dtype=np.float64), np.asarray(pose.ravel(), dtype=np.int64)


def planned(campaign: Campaign, model: StoredModel, most_balls: int) -> PlannedCampaign:
    """The candidates of a campaign; where it has fewer than ``most_balls`` balls, places for more are added."""
    whole = campaign_method(campaign).problem_of(campaign, as_model(model))
    assert isinstance(whole, TouchProblem)  # what a method with a TouchPlan has
    whole = _with_identified_tip(whole)
    problem = _first_run(whole)
    context, chain = problem.context, problem.context.chain
    visited, pose = _indexations(problem)
    targets = list(problem.targets)
    places = np.array([context.nominal[np.flatnonzero(context.target == name)[0]] for name in targets])
    ends = {name for distance in problem.distances for name in distance.between}
    balls = [name for name in targets if name not in ends]
    if most_balls > len(balls):
        new = more_balls(places[[targets.index(name) for name in balls]], most_balls - len(balls))
        targets += [f"new {number + 1}" for number in range(len(new))]
        places = np.concatenate([places, new])
    rotary, linear = strokes_of(campaign, chain, whole.context.positions)
    grid = pose_grid(chain, context.positions, rotary)
    poses = np.unique(np.round(np.concatenate([visited, grid]), 6), axis=0)
    pose_index = np.array([int(np.flatnonzero((poses == row).all(axis=1))[0]) for row in visited])
    touches = candidate_touches(problem, poses, targets, places, linear)
    touched = np.zeros(touches.reachable.shape, dtype=bool)
    touched[pose_index[pose], [targets.index(str(target)) for target in context.target]] = True
    bar_columns = [targets.index(name) for name in sorted(ends)]
    candidates = Candidates(
        replace(touches, reachable=touches.reachable | touched),
        balls=tuple(index for index, name in enumerate(targets) if name not in ends),
        bar_poses=tuple(map(int, np.flatnonzero(touched[:, bar_columns].any(axis=1)))),
        time=_time_model(problem, pose.astype(float)),
    )
    present = candidates.choice(
        tuple(map(int, np.unique(pose_index))), tuple(targets.index(name) for name in balls), touched
    )
    return PlannedCampaign(campaign, problem, candidates, present, places)
