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
from dataclasses import dataclass

import numpy as np

from monitor.exceptions import DataError, InputError
from monitor.machine import Chain
from monitor.methods.chain.expected import (
    Expected,
    Mask,
    Sums,
    Touches,
    expected,
    information,
    sums_by_pose,
    sums_of,
)
from monitor.records import Array

# The grid of rotary positions; finer ones change the choice, not what it achieves.
STEP_RAD = math.pi / 6.0
SPINDLE = (0.0, math.pi / 2.0, math.pi, 1.5 * math.pi)
MOST_POSES, MOST_BALLS = 40, 24
# So much of the information of all candidates keeps a plan that has too few touches yet comparable with others.
RIDGE = 1e-4
MOST_PASSES = 4
# An exchange must gain this part, so that rounding does not drive it round in circles.
GAIN = 1e-6


@dataclass(frozen=True)
class TimeModel:
    """Seconds for probing one target, and for going to another indexation besides."""

    probing_s: float
    indexation_s: float
    source: str

    def seconds(self, touched: Mask) -> float:
        """How long a plan (P, T) takes."""
        return self.probing_s * float(touched.sum()) + self.indexation_s * float(touched.any(axis=1).sum())


@dataclass(frozen=True)
class Choice:
    """A plan: ``poses`` and ``balls`` are places in the candidates, ``touched`` (P, T) what is probed."""

    poses: tuple[int, ...]
    balls: tuple[int, ...]
    touched: Mask
    expected: Expected
    seconds: float


@dataclass(frozen=True)
class Candidates:
    """What may be chosen: ``balls`` are places of targets that may be left out; ``bar_poses`` those of indexations
    at which the bar's ends are probed, which every plan keeps."""

    touches: Touches
    balls: tuple[int, ...]
    bar_poses: tuple[int, ...]
    time: TimeModel

    def touched(self, poses: tuple[int, ...], balls: tuple[int, ...]) -> Mask:
        """All balls at all poses that they can be reached at, and the bar at its own (P, T)."""
        found = np.zeros(self.touches.reachable.shape, dtype=bool)
        found[np.ix_(list(poses), list(balls))] = True
        found &= self.touches.reachable
        for bar in self.touches.bars:
            found[np.ix_(list(self.bar_poses), [bar.first, bar.second])] = True
        return found

    def choice(self, poses: tuple[int, ...], balls: tuple[int, ...], touched: Mask | None = None) -> Choice:
        """A plan of the given poses and balls; ``touched`` where it is not all of them everywhere."""
        touched = self.touched(poses, balls) if touched is None else touched
        return Choice(
            tuple(sorted(poses)),
            tuple(sorted(balls)),
            touched,
            expected(self.touches, touched),
            self.time.seconds(touched),
        )


def pose_grid(chain: Chain, visited: Array, strokes: Mapping[str, tuple[float, float]]) -> Array:
    """Rotary poses (P, J) to choose from: steps of 30 degrees over the strokes (else the visited range) of the
    rotary axes, the spindle turned by quarters where the others stand at zero only."""
    rows = [np.zeros(len(chain.joints))]
    for place, joint in enumerate(chain.joints):
        if joint.kind != "rotary":
            continue
        low, high = strokes.get(joint.name, (float(visited[:, place].min()), float(visited[:, place].max())))
        if high - low >= 2.0 * math.pi:
            low, high = low, low + 2.0 * math.pi - STEP_RAD
        steps = STEP_RAD * np.arange(math.ceil(low / STEP_RAD - 1e-9), math.floor(high / STEP_RAD + 1e-9) + 1)
        rows = [np.where(np.arange(len(row)) == place, value, row) for row in rows for value in steps] or rows
    spindles = [place for place, joint in enumerate(chain.joints) if joint.kind == "spindle"]
    if spindles and np.ptp(visited[:, spindles]) > 0.0:
        for angle in SPINDLE[1:]:
            turned = np.zeros(len(chain.joints))
            turned[spindles] = angle
            rows.append(turned)
    return np.array(rows)


def more_balls(places: Array, count: int) -> Array:
    """``count`` further places (count, 3) mm within the cylinder about the table's axis that the given ones span.

    Golden-angle spiral (Vogel, Mathematical Biosciences 44 (1979) 179): spread evenly however many there are.
    """
    radius = np.linalg.norm(places[:, :2], axis=1)
    low, high = float(radius.min()) / 2.0, float(radius.max())
    bottom, top = float(places[:, 2].min()), float(places[:, 2].max())
    number = np.arange(count)
    share = (number + 0.5) / count
    distance = np.sqrt(low**2 + (high**2 - low**2) * share)
    angle = number * math.pi * (3.0 - math.sqrt(5.0)) + 0.5
    # Heights by the golden ratio too, so that height and radius do not go together.
    height = bottom + (top - bottom) * np.mod(number * (math.sqrt(5.0) - 1.0) / 2.0 + 0.25, 1.0)
    return np.column_stack([distance * np.cos(angle), distance * np.sin(angle), height])


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

    def _with_each(self, kept: tuple[int, ...], balls: tuple[int, ...], single: Sums) -> Array:
        """The cost (P,) of ``kept`` with one more of all poses, infinite for those that it has."""
        now = sums_of(self.candidates.touches, self.candidates.touched(kept, balls))
        costs = self.cost(now + single)
        costs[list(kept)] = np.inf
        return costs

    def _by_pose(self, balls: tuple[int, ...]) -> Sums:
        touches = self.candidates.touches
        touched = np.zeros(touches.reachable.shape, dtype=bool)
        touched[:, list(balls)] = touches.reachable[:, list(balls)]
        return sums_by_pose(touches, touched)

    def poses(self, count: int, balls: tuple[int, ...], start: tuple[int, ...] = ()) -> tuple[int, ...]:
        """``count`` poses for the given balls, those of the bar among them."""
        bar = self.candidates.bar_poses
        chosen = tuple(dict.fromkeys((*bar, *start)))[: max(count, len(bar))]
        single = self._by_pose(balls)
        while len(chosen) < count:
            chosen = (*chosen, int(self._with_each(chosen, balls, single).argmin()))
        for _ in range(MOST_PASSES):
            before = chosen
            for out in [one for one in chosen if one not in bar]:
                kept = tuple(one for one in chosen if one != out)
                costs = self._with_each(kept, balls, single)
                if costs.min() < (1.0 - GAIN) * costs[out]:
                    chosen = (*kept, int(costs.argmin()))
            if chosen == before:
                break
        return chosen

    def balls(self, count: int, poses: tuple[int, ...]) -> tuple[int, ...]:
        """``count`` balls for the given poses."""
        every = self.candidates.balls

        def costs(sets: list[tuple[int, ...]]) -> Array:
            plans = np.array([self.candidates.touched(poses, balls) for balls in sets])
            return self.cost(sums_of(self.candidates.touches, plans))

        chosen: tuple[int, ...] = ()
        while len(chosen) < count:
            left = [(*chosen, one) for one in every if one not in chosen]
            chosen = left[int(costs(left).argmin())]
        for _ in range(MOST_PASSES):
            before = chosen
            for out in chosen:
                sets = [
                    chosen,
                    *((*(b for b in chosen if b != out), one) for one in every if one not in chosen),
                ]
                found = costs(sets)
                if found.min() < (1.0 - GAIN) * found[0]:
                    chosen = sets[int(found.argmin())]
            if chosen == before:
                break
        return chosen


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
    there, bar = len(candidates.balls), len(candidates.bar_poses)
    if not 1 <= balls <= there:
        raise InputError(f"--balls {balls}: choose 1 to {there}")
    most = min(MOST_POSES, len(candidates.touches.poses))
    if poses is not None and not max(bar, 3) <= poses <= most:
        raise InputError(
            f"--poses {poses}: choose {max(bar, 3)} to {most}; a ball needs three indexations to fix its own place"
        )
    search = _Search(candidates, wanted or {})
    where = present
    which = search.balls(balls, where) if balls < there else candidates.balls
    if poses is not None:
        for _ in range(MOST_PASSES):
            where = search.poses(poses, which, () if poses < len(where) else where)
            again = search.balls(balls, where) if balls < there else which
            if set(again) == set(which):
                break
            which = again
    return candidates.choice(where, which)


def quickest_plan(candidates: Candidates, wanted: Mapping[str, float], most_balls: int) -> Choice:
    """The plan that reaches all ``wanted`` uncertainties (internal units) in the shortest time.

    For every number of balls the poses are added one by one until it suffices, then exchanged to do without one.
    Raises DataError where no plan of the candidates reaches them, with what the best would.
    """
    names = candidates.touches.names[: candidates.touches.reported]
    unknown = [name for name in wanted if name not in names]
    if unknown:
        raise InputError(f"--wanted {unknown[0]}: there is no such parameter; there are {', '.join(names)}")
    bad = [name for name, u in wanted.items() if not (u > 0.0 and math.isfinite(u))]
    if bad:
        raise InputError(f"--wanted {bad[0]}: an uncertainty is a number above 0")
    search = _Search(candidates, wanted)
    most = min(MOST_POSES, len(candidates.touches.poses))
    found: Choice | None = None
    nearest = math.inf
    # What everything at once cannot reach, no plan can.
    bound = _excess(candidates.choice(tuple(range(len(candidates.touches.poses))), candidates.balls), wanted)
    for count in range(1, (most_balls if bound <= 1.0 else 0) + 1):
        poses = search.poses(max(3, len(candidates.bar_poses)), candidates.balls)
        while len(poses) <= most:
            balls = search.balls(count, poses) if count < len(candidates.balls) else candidates.balls
            choice = candidates.choice(poses, balls)
            excess = _excess(choice, wanted)
            nearest = min(nearest, excess)
            if found is not None and choice.seconds >= found.seconds:
                break
            if excess <= 1.0:
                found = _with_fewer_poses(search, choice, wanted)
                break
            if len(poses) == most:
                break
            poses = search.poses(len(poses) + 1, balls, poses)
    if found is None:
        above = nearest if bound <= 1.0 else bound
        raise DataError(
            f"no plan of up to {most_balls} balls and {most} indexations reaches the wanted uncertainties: the best "
            f"that was found is {above:.2g} times above one of them; use a better probe or bar, "
            "more runs, or other places of the balls"
        )
    return found


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
