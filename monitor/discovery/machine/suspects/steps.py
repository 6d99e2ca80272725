"""Steps between runs: a parameter that jumped, a ball that stands elsewhere since some run.

Reported as what they are, with a stated false-alarm probability; the search itself is in ``statistics.changes``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.discovery.machine.fit import Fit
from monitor.records import Array
from monitor.statistics import find_changes

# One false alarm in a hundred campaigns, half of it for the parameters and half for the balls.
FALSE_ALARM = 0.01
FEWEST_RUNS = 6
# Where the runs happen to scatter less than their known uncertainty, that uncertainty counts: a step is reported
# from four standard deviations on, one in 16 000 by chance.
STANDARD_DEVIATIONS = 4.0


@dataclass(frozen=True)
class Step:
    """A step from ``run`` on; ``size`` in internal units. ``parameter`` or ``target`` names what changed."""

    parameter: str | None
    target: str | None
    run: int
    size: float
    u: float
    p_value: float


def _series(fit: Fit) -> dict[str, Array]:
    return {
        name: fit.solution.local[:, index]
        for index, name in enumerate(fit.problem.base_names)
        if fit.solution.local_free[:, index].all()
    }


def _balls(fit: Fit, left_out: frozenset[str], moved: frozenset[str]) -> dict[str, Array]:
    """Coordinates of every ball less those of the ball set's middle, which a shift of the whole set leaves.

    Balls of ``left_out`` are not wanted; those of ``moved`` neither, and do not count for the middle.
    """
    movable = fit.problem.movable
    touched = [int(np.sum(fit.problem.context.target == target)) for target in movable]
    # A ball touched once a run has nothing to check it, and moves with the readings.
    often = [
        ball
        for ball, times in enumerate(touched)
        if times >= 3 * len(fit.problem.runs) and movable[ball] not in moved
    ]
    if len(often) < 3:
        return {}
    coordinates = np.array(
        [[fit.problem.local_names.index(f"ball {name} {axis}") for axis in "xyz"] for name in movable]
    )
    centres = fit.solution.local[:, coordinates[often]]
    middle = np.median(centres - centres[:1], axis=1, keepdims=True)
    relative = centres - centres[:1] - middle
    return {
        f"{movable[ball]}|{'xyz'[axis]}": relative[:, index, axis]
        for index, ball in enumerate(often)
        for axis in range(3)
        if movable[ball] not in left_out
    }


def _u_of_step(fit: Fit, unknown: int, index: int) -> float:
    """Standard uncertainty of the difference of the means before and after, from each run's own covariance."""
    variance = fit.solution.local_covariance[:, unknown, unknown]
    before, after = variance[:index], variance[index:]
    return float(np.sqrt(before.mean() / len(before) + after.mean() / len(after)))


def find_steps(
    fit: Fit, started: Array, rng: np.random.Generator, moved_within: frozenset[str] = frozenset()
) -> list[Step]:
    """Steps of parameters and balls over the runs, which began at ``started`` (R,), in days, rising.

    Balls that were seen to move inside a run (``moved_within``) are not reported twice.
    """
    if len(fit.problem.runs) < FEWEST_RUNS:
        return []
    stepped = _search(fit, _series(fit), started, rng)
    # A ball that moved shifts the middle a little; the others are looked at again without it.
    moved: list[Step] = []
    while True:
        without = frozenset(str(step.target) for step in moved)
        steps = _search(fit, _balls(fit, moved_within, without), started, rng)
        if not steps:
            return stepped + moved
        largest = max(steps, key=lambda step: abs(step.size) / step.u)
        moved += [step for step in steps if step.target == largest.target]


def _search(fit: Fit, series: dict[str, Array], started: Array, rng: np.random.Generator) -> list[Step]:
    """Steps of several series; of a ball's three coordinates the largest step at every run."""
    if not series:
        return []
    # Twice as many trials as the level of one series needs at least.
    level = FALSE_ALARM / 2.0
    trials = int(2 * len(series) / level)
    history = find_changes(series, started, rng=rng, false_alarm=level, trials=trials)
    largest: dict[tuple[str, int], Step] = {}
    for change in history.changes:
        if change.kind != "step":
            continue
        run = int(fit.problem.runs[change.index])
        name, _, axis = change.parameter.partition("|")
        unknown = fit.problem.local_names.index(f"ball {name} {axis}" if axis else name)
        if abs(change.size) < STANDARD_DEVIATIONS * _u_of_step(fit, unknown, change.index):
            continue
        # The level is that of the whole search.
        p_value = min(1.0, change.p_value * len(series))
        step = Step(None if axis else name, name if axis else None, run, change.size, change.u, p_value)
        before = largest.get((name, run))
        if before is None or abs(step.size) > abs(before.size):
            largest[(name, run)] = step
    return list(largest.values())
