"""The best balls and indexations: as sharp as can be for their number, or sharp enough in the shortest time.

A-optimal by exchange (Fedorov, Theory of optimal experiments, 1972, chapter 3): the sum of the squared expected
uncertainties, each against what is wanted of it (else against what all candidates together would give), is made
as small as possible by adding the best, then exchanging one for another while that helps. Exchange finds a plan
that no single exchange improves; the best of all may be a little better. What is probed at once (all balls of
the plan at every indexation) and the indexations at which the bar is probed are given.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from monitor.exceptions import DataError, InputError, did_you_mean
from monitor.methods.planning.candidates import Candidates, Choice
from monitor.methods.planning.expected import Sums, expected, information, sums_by_pose, sums_of
from monitor.records import Array
from monitor.stopping import checkpoint

MOST_POSES, MOST_BALLS = 40, 24
# So much of the information of all candidates keeps a plan that has too few touches yet comparable with others.
RIDGE = 1e-4
MOST_PASSES = 4
# An exchange must gain this part, so that rounding does not drive it round in circles.
GAIN = 1e-6


class _Search:
    """A-optimal exchange over poses and balls of one set of candidates."""

    def __init__(self, candidates: Candidates, wanted: Mapping[str, float]) -> None:
        self.candidates = candidates
        touches = candidates.touches
        everything = candidates.touched(tuple(range(len(touches.poses))), candidates.balls)
        self.prior = RIDGE * information(touches, sums_of(touches, everything))
        # What no candidate tells apart stays apart from the search.
        self.prior += np.diag(1e-9 * np.diag(self.prior) + np.finfo(float).tiny)
        best = expected(touches, everything)
        goal = np.where(best.determined, best.u, np.inf)
        if wanted:
            goal = np.full(touches.reported, np.inf)
            for name, u in wanted.items():
                goal[touches.names.index(name)] = u
        self.weights = np.concatenate([1.0 / goal**2, np.zeros(len(touches.names) - touches.reported)])

    def cost(self, sums: Sums) -> Array:
        """The weighted sum of squared uncertainties (n,) of plans (n, ...)."""
        inverse = np.linalg.inv(information(self.candidates.touches, sums) + self.prior)
        return np.asarray(np.einsum("...ii,i->...", inverse, self.weights))

    def _with_each(self, poses: tuple[int, ...], balls: tuple[int, ...], single: Sums) -> Array:
        """The cost (P,) of ``poses`` with one more of all poses, infinite for those that it has."""
        sums = sums_of(self.candidates.touches, self.candidates.touched(poses, balls))
        costs = self.cost(sums + single)
        costs[list(poses)] = np.inf
        return costs

    def _by_pose(self, balls: tuple[int, ...]) -> Sums:
        touches = self.candidates.touches
        touched = np.zeros(touches.reachable.shape, dtype=bool)
        touched[:, list(balls)] = touches.reachable[:, list(balls)]
        return sums_by_pose(touches, touched)

    def poses(self, count: int, balls: tuple[int, ...], start: tuple[int, ...] = ()) -> tuple[int, ...]:
        """``count`` poses for the given balls, those of the bar among them."""
        bar = self.candidates.bar_poses
        selected = tuple(dict.fromkeys((*bar, *start)))[: max(count, len(bar))]
        single = self._by_pose(balls)
        while len(selected) < count:
            checkpoint()
            selected = (*selected, int(self._with_each(selected, balls, single).argmin()))
        for _ in range(MOST_PASSES):
            checkpoint()
            before = selected
            for out in [pose for pose in selected if pose not in bar]:
                others = tuple(pose for pose in selected if pose != out)
                costs = self._with_each(others, balls, single)
                if costs.min() < (1.0 - GAIN) * costs[out]:
                    selected = (*others, int(costs.argmin()))
            if selected == before:
                break
        return selected

    def balls(self, count: int, poses: tuple[int, ...]) -> tuple[int, ...]:
        """``count`` balls for the given poses."""
        every = self.candidates.balls

        def costs(sets: list[tuple[int, ...]]) -> Array:
            plans = np.array([self.candidates.touched(poses, balls) for balls in sets])
            return self.cost(sums_of(self.candidates.touches, plans))

        selected: tuple[int, ...] = ()
        while len(selected) < count:
            checkpoint()
            larger = [(*selected, ball) for ball in every if ball not in selected]
            selected = larger[int(costs(larger).argmin())]
        for _ in range(MOST_PASSES):
            checkpoint()
            before = selected
            for out in selected:
                sets = [
                    selected,
                    *(
                        (*(other for other in selected if other != out), ball)
                        for ball in every
                        if ball not in selected
                    ),
                ]
                exchanged = costs(sets)
                if exchanged.min() < (1.0 - GAIN) * exchanged[0]:
                    selected = sets[int(exchanged.argmin())]
            if selected == before:
                break
        return selected


def best_plan(
    candidates: Candidates,
    balls: int,
    poses: int | None = None,
    *,
    present: tuple[int, ...],
    wanted: Mapping[str, float] | None = None,
) -> Choice:
    """The best ``balls`` balls at the best ``poses`` indexations, or at those of the ``present`` plan.

    ``wanted`` gives uncertainties of parameters in internal units that matter; without it all matter alike.
    Raises InputError for numbers that the candidates do not allow.
    """
    available, bar_poses = len(candidates.balls), len(candidates.bar_poses)
    if not 1 <= balls <= available:
        raise InputError(f"--balls {balls}: choose 1 to {available}")
    most = min(MOST_POSES, len(candidates.touches.poses))
    if poses is not None and not max(bar_poses, 3) <= poses <= most:
        raise InputError(
            f"--poses {poses}: choose {max(bar_poses, 3)} to {most}; a ball needs three indexations to fix its own "
            "place"
        )
    search = _Search(candidates, wanted or {})
    at_poses = present
    at_balls = search.balls(balls, at_poses) if balls < available else candidates.balls
    if poses is not None:
        for _ in range(MOST_PASSES):
            checkpoint()
            at_poses = search.poses(poses, at_balls, () if poses < len(at_poses) else at_poses)
            again = search.balls(balls, at_poses) if balls < available else at_balls
            if set(again) == set(at_balls):
                break
            at_balls = again
    return candidates.choice(at_poses, at_balls)


def quickest_plan(candidates: Candidates, wanted: Mapping[str, float], most_balls: int) -> Choice:
    """The plan that reaches all ``wanted`` uncertainties (internal units) in the shortest time.

    For every number of balls the poses are added one by one until it suffices, then exchanged to do without one.
    Raises InputError for what cannot be wanted, DataError where no plan of the candidates reaches it, with what the
    best would.
    """
    _check_wanted(candidates, wanted)
    search = _Search(candidates, wanted)
    most = min(MOST_POSES, len(candidates.touches.poses))
    # What everything at once cannot reach, no plan can.
    everything = candidates.choice(tuple(range(len(candidates.touches.poses))), candidates.balls)
    nearest = bound = _excess(everything, wanted)
    quickest: Choice | None = None
    if bound <= 1.0:
        nearest = math.inf
        for count in range(1, most_balls + 1):
            limit = math.inf if quickest is None else quickest.seconds
            quicker, excess = _quicker_plan(search, wanted, count, most, limit)
            quickest = quicker or quickest
            nearest = min(nearest, excess)
    if quickest is None:
        raise DataError(
            f"no plan of up to {most_balls} balls and {most} indexations reaches the wanted uncertainties: the best "
            f"that was found is {nearest:.2g} times above one of them; use a better probe or bar, "
            "more runs, or other places of the balls"
        )
    return quickest


def _check_wanted(candidates: Candidates, wanted: Mapping[str, float]) -> None:
    names = candidates.touches.names[: candidates.touches.reported]
    unknown = [name for name in wanted if name not in names]
    if unknown:
        hint = did_you_mean(unknown[0], names)
        raise InputError(
            f"--wanted {unknown[0]}: there is no such parameter; {hint}there are {', '.join(names)}"
        )
    bad = [name for name, u in wanted.items() if not (u > 0.0 and math.isfinite(u))]
    if bad:
        raise InputError(f"--wanted {bad[0]}: an uncertainty is a number above 0")


def _quicker_plan(
    search: _Search, wanted: Mapping[str, float], count: int, most_poses: int, limit_s: float
) -> tuple[Choice | None, float]:
    """A plan of ``count`` balls that suffices and takes less than ``limit_s``, None where there is none; and the
    smallest excess of those that were tried."""
    candidates = search.candidates
    nearest = math.inf
    poses = search.poses(max(3, len(candidates.bar_poses)), candidates.balls)
    while len(poses) <= most_poses:
        balls = search.balls(count, poses) if count < len(candidates.balls) else candidates.balls
        choice = candidates.choice(poses, balls)
        excess = _excess(choice, wanted)
        nearest = min(nearest, excess)
        if choice.seconds >= limit_s:
            break
        if excess <= 1.0:
            return _with_fewer_poses(search, choice, wanted), nearest
        if len(poses) == most_poses:
            break
        poses = search.poses(len(poses) + 1, balls, poses)
    return None, nearest


def _excess(choice: Choice, wanted: Mapping[str, float]) -> float:
    """The largest uncertainty against what is wanted of it; infinite where there is no number."""
    u = dict(zip(choice.expected.names, choice.expected.u, strict=True))
    ratios = [float(u[name]) / limit for name, limit in wanted.items()]
    return max((ratio if math.isfinite(ratio) else math.inf) for ratio in ratios)


def _with_fewer_poses(search: _Search, choice: Choice, wanted: Mapping[str, float]) -> Choice:
    fewest = max(3, len(search.candidates.bar_poses))
    while len(choice.poses) > fewest:
        poses = search.poses(len(choice.poses) - 1, choice.balls)
        fewer = search.candidates.choice(poses, choice.balls)
        if _excess(fewer, wanted) > 1.0:
            break
        choice = fewer
    return choice
