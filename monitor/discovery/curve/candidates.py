"""What a curve may lack: every effect that its columns allow, as candidates for the same scan that machines have."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
import scipy

from monitor.discovery.curve.scene import Scene, effect_of, variant
from monitor.discovery.machine.evidence import orthonormal, weigh, without
from monitor.discovery.machine.visible import Candidate, Visible
from monitor.effects.curve import SEARCHED, SEQUENCE, CurveEffect, group_names
from monitor.effects.curve.calendar import CALENDAR
from monitor.methods.curve.problem import SHORTEST_CONSTANT, CurveProblem, grid
from monitor.records import Array

POWERS = (1, 2, 3)
#: Numbers in all candidates together: 160 MB. Beyond, only the values that explain most by themselves are kept;
#: the search over all of them is still paid for.
MOST_NUMBERS = 20_000_000
#: Periods looked at for one input; a series of 4000 rows has as many, a longer one is not searched below
#: range / 2000.
MOST_PERIODS = 6000
#: A calendar period is looked for from so many cycles on.
FEWEST_CYCLES = 1.5
#: Two periods of one input are told apart from a whole cycle over its range on (Rayleigh's criterion).
APART = 1.0


def tries_of(effect: CurveEffect, values: Array) -> list[int]:
    """What the search for each value costs: the inverse of its probability beforehand.

    Periods are as likely between 5 and 10 as between 50 and 100 (even in the logarithm), constants and places all
    the same.
    """
    if effect.shape != "sin":
        return [len(values)] * len(values)
    total = float(np.sum(values))
    return [int(np.ceil(total / value)) for value in values]


def catalogue(problem: CurveProblem) -> Iterator[CurveEffect]:
    """Every effect that the columns name; those that the model has already are left out."""
    known = {effect.family for effect in problem.effects if effect.shape != "sin"}
    has = {(effect.column, power) for effect in problem.effects for power in range(1, effect.order + 1)}
    clock = problem.curve.time or SEQUENCE
    for name in problem.inputs.numbers:
        if name == SEQUENCE and (clock != SEQUENCE or rows_are_sorted(problem)):
            continue
        for power in POWERS:
            if (name, power) not in has:
                yield CurveEffect(name, "drift" if name == clock and power == 1 else f"poly{power}")
        if name == clock:
            yield from _calendar(problem, name)
        yield from (
            CurveEffect(name, shape, free=True) for shape in SEARCHED if f"{name}:{shape}" not in known
        )
    for name in problem.inputs.groups:
        if f"{name}:group" not in known:
            yield CurveEffect(name, "group")


def _calendar(problem: CurveProblem, clock: str) -> Iterator[CurveEffect]:
    """The periods that nobody needs to search: those of the calendar that the rows can show."""
    x = np.unique(problem.inputs.numbers[clock])
    known = {effect.text for effect in problem.effects}
    for length, _, _ in CALENDAR.get(problem.inputs.units.get(clock, ""), ()):
        effect = CurveEffect(clock, "sin", length)
        enough = (x[-1] - x[0]) / length >= FEWEST_CYCLES and len(x) >= 2 * (x[-1] - x[0]) / length
        if enough and effect.text not in known:
            yield effect


def rows_are_sorted(problem: CurveProblem) -> bool:
    """Whether the order of the rows follows the inputs, so that it says nothing of time: an input that only rises or
    falls and repeats values, or labels in blocks within blocks."""
    for name, values in problem.inputs.numbers.items():
        steps = np.diff(values)
        if name != SEQUENCE and (steps == 0).any() and ((steps >= 0).all() or (steps <= 0).all()):
            return True
    blocks = np.zeros(len(problem.curve), dtype=np.int64)
    nested = 0
    for labels in problem.inputs.groups.values():
        both = [f"{block} {label}" for block, label in zip(blocks, labels, strict=True)]
        changes = 1 + sum(one != other for one, other in pairwise(both))
        if changes == len(set(both)) and len(set(both)) > len(np.unique(blocks)):
            blocks = np.unique(both, return_inverse=True)[1]
            nested += 1
    return nested > 1


def see(scene: Scene) -> Visible:
    """All candidates, and the residual that they may explain."""
    problem = scene.fit.problem
    residual = without(scene.basis, scene.measured[:, None])[:, 0]
    candidates: list[Candidate] = []
    refused: list[tuple[str, str]] = []
    room = MOST_NUMBERS // max(len(residual), 1) // 2
    for effect in catalogue(problem):
        if effect.free:
            values = grid(effect, problem.inputs)[:MOST_PERIODS]
            if len(values) == 0:
                refused.append((effect.text, f"{effect.column} takes too few values to search it"))
                continue
            costs = dict(zip(values.tolist(), tries_of(effect, values), strict=True))
            if len(values) > room // len(problem.inputs.numbers):
                values = _promising(scene, residual, effect, values, room // len(problem.inputs.numbers))
            searched = values.tolist()
            candidates += scene.candidates(
                [effect.at(value) for value in searched], [costs[value] for value in searched]
            )
        elif effect.order and len(np.unique(problem.inputs.numbers[effect.column])) <= effect.order:
            refused.append((effect.text, f"{effect.column} takes too few values"))
        elif effect.shape == "group" and not _groups_say_something(problem, effect):
            refused.append(
                (effect.text, f"{effect.column} has one label, or a label of its own in nearly every row")
            )
        else:
            candidates.append(scene.candidate(effect))
    return Visible(
        residual=residual,
        added=np.zeros((len(residual), 0)),
        run=np.zeros(len(residual), dtype=np.int64),
        degrees_of_freedom=len(residual) - scene.basis.shape[1],
        candidates=tuple(candidates),
        refused=tuple(refused),
    )


def _groups_say_something(problem: CurveProblem, effect: CurveEffect) -> bool:
    labels = problem.inputs.groups[effect.column]
    return 1 < len(group_names(labels)) <= len(labels) / 2


def _promising(scene: Scene, residual: Array, effect: CurveEffect, values: Array, most: int) -> Array:
    """The values that explain most of the residual, each by itself."""
    explained = np.empty(len(values))
    for place, value in enumerate(values):
        left = without(scene.basis, scene.whitened(scene.columns(effect, float(value))))
        own = orthonormal(left)
        explained[place] = float(np.sum((own.T @ residual) ** 2))
    return values[np.sort(np.argsort(-explained)[:most])]


def separable(problem: CurveProblem) -> Callable[[Sequence[Candidate], Candidate], bool]:
    """Whether a period lies far enough from those in the model and those chosen before."""
    spans = {name: float(np.ptp(values)) for name, values in problem.inputs.numbers.items()}
    known = [(one.column, 1.0 / one.value) for one in problem.effects if one.shape == "sin" and one.value]

    @lru_cache(maxsize=1)
    def taken(chosen: tuple[CurveEffect, ...]) -> dict[str, list[float]]:
        """The rates of the periods by input; the same for thousands of candidates in a row."""
        rates: dict[str, list[float]] = {name: [] for name in spans}
        for column, rate in known:
            rates[column].append(rate)
        for other in chosen:
            if other.shape == "sin" and other.value:
                rates[other.column].append(1.0 / other.value)
        return rates

    def apart(chosen: Sequence[Candidate], one: Candidate) -> bool:
        effect = effect_of(one)
        if effect.shape != "sin" or effect.value is None:
            return True
        rate, least = 1.0 / effect.value, APART / spans[effect.column]
        rates = taken(tuple(effect_of(other) for other in chosen))[effect.column]
        return all(abs(other - rate) >= least for other in rates)

    return apart


def at_best(scene: Scene, visible: Visible, chosen: Sequence[Candidate], place: int) -> Candidate:
    """The candidate at ``place`` with its searched value at its best, the other chosen ones fitted along.

    Its family then holds the value, so that a second period of the same input can be found after it.
    """
    candidate = chosen[place]
    effect = effect_of(candidate)
    if not effect.free or effect.shape == "step" or effect.value is None:
        return candidate if not effect.free else _named(candidate, effect)
    others = np.concatenate(
        [visible.added, *(one.columns for other, one in enumerate(chosen) if other != place)], axis=1
    )
    tries = candidate.variant.tries

    def badness(rate: float) -> float:
        one = scene.candidate(effect.at(1.0 / rate), tries)
        found = weigh([one], visible.residual, others, visible.degrees_of_freedom)
        return -found[0].explained

    rate = 1.0 / effect.value
    x = np.unique(scene.fit.problem.inputs.numbers[effect.column])
    span = float(x[-1] - x[0])
    if effect.shape == "sin":
        low, high = max(rate - 1.0 / (3.0 * span), 1.0 / span), rate + 1.0 / (3.0 * span)
    else:
        # Between the neighbours on the grid, and never shorter than the distance of the rows.
        most = 1.0 / (SHORTEST_CONSTANT * float(np.median(np.diff(x))))
        low, high = sorted((0.6 * rate, float(np.clip(1.6 * rate, -most, most))))
    if high <= low:
        return _named(candidate, effect)
    best = scipy.optimize.minimize_scalar(
        badness, bounds=(low, high), method="bounded", options={"xatol": 1e-4 * (high - low), "maxiter": 40}
    )
    better = effect.at(1.0 / float(best.x)) if best.fun <= badness(rate) else effect
    return _named(scene.candidate(better, tries), better)


def _named(candidate: Candidate, effect: CurveEffect) -> Candidate:
    return replace(candidate, variant=variant(effect, candidate.variant.tries, effect.text))
