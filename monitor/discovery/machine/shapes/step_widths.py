"""Widths of steps: each of several over its own, and none that a longer way says as much of.

Steps of one effect have one width. One that goes at once and one over sixty millimetres, told over one width between
the two, would leave errors that others mimic, and no step of theirs would be the sharpest way.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import product
from typing import NamedTuple

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate
from monitor.discovery.machine.shapes.refine import LIMIT
from monitor.discovery.machine.shapes.steps_seen import LEAST_REGION, NEAR_WIDTHS, WIDTHS_APART, StepsSeen
from monitor.discovery.search.projection import orthonormal, without
from monitor.effects import ChainEffect
from monitor.effects.shapes import Step
from monitor.records import Array

# Each of several steps is sought over a width of its own beside the others, so often, at so many places about it, and
# at so many about the best of these over widths near its own.
TURNS, PLACES_ABOUT, PLACES_NEAR = 2, 17, 9
# Longer ways are tried in place of each step, as parts of the shortest that is no step: three gaps between positions.
LONGER_WAYS = (1.0, 1.41, 2.0, 2.83, 4.0)
# What is left that differs by less than this part is the same.
ALIKE = 1e-9


class OneStep(NamedTuple):
    """A step at a place, over a width, both in mm."""

    at_mm: float
    width: float


def by_width(of_error: StepsSeen, steps: Sequence[OneStep]) -> list[ChainCandidate]:
    """Steps as one effect for each width, in the order of their first places."""
    ordered = sorted(steps)
    widths = dict.fromkeys(step.width for step in ordered)
    return [
        of_error.candidate([step.at_mm for step in ordered if step.width == width], width) for width in widths
    ]


def at_widths_of_their_own(
    of_error: StepsSeen, steps: Sequence[OneStep], others: Sequence[ChainCandidate]
) -> list[OneStep]:
    """Several steps of one width, each over the width at which it says most beside the rest, where these are worth
    their price: each width is one more unknown."""
    if len(steps) < 2:
        return list(steps)
    best = list(steps)
    for _, index in product(range(TURNS), range(len(steps))):
        rest = best[:index] + best[index + 1 :]
        about = _able(of_error, _about(of_error, steps[index]), rest) or [steps[index]]
        step = _likeliest(of_error, about, rest, others)
        near = _able(of_error, _near(of_error, step, steps[index]), rest)
        best[index] = _likeliest(of_error, [step, *near], rest, others) if near else step
    before, after = ({step.width for step in some if step.width} for some in (steps, best))
    price = of_error.price(max(len(after) - len(before), 1), others)
    return best if _cost(of_error, best, others) + price < _cost(of_error, steps, others) else list(steps)


def _likeliest(
    of_error: StepsSeen, able: Sequence[OneStep], rest: Sequence[OneStep], others: Sequence[ChainCandidate]
) -> OneStep:
    """The one of some steps that says most beside the rest; the middle one of several that say as much."""
    remaining = _left_with_each(of_error, able, rest, others)
    least = remaining.min() * (1.0 + ALIKE)
    alike = [step for step, square in zip(able, remaining, strict=True) if square <= least]
    # A way between two positions is a step at once.
    alike = [step for step in alike if step.width == alike[0].width]
    return alike[len(alike) // 2]


def _reach(of_error: StepsSeen, step: OneStep) -> float:
    """How far in mm from a step its place is sought over other widths."""
    travel = float(of_error.positions[-1, 1] - of_error.positions[0, 0])
    return max(step.width, LEAST_REGION * travel) + float(np.diff(of_error.middles_of_positions).max())


def _about(of_error: StepsSeen, step: OneStep) -> list[OneStep]:
    """The steps about one, at once and over the widths that are tried of all."""
    reach = _reach(of_error, step)
    at_once = [OneStep(float(at), 0.0) for at in of_error.middles if abs(at - step.at_mm) <= reach]
    places = np.round(step.at_mm + np.linspace(-reach, reach, PLACES_ABOUT), 2).tolist()
    return [*at_once, *(OneStep(at, width) for width in of_error.widths if width for at in places)]


def _near(of_error: StepsSeen, step: OneStep, first: OneStep) -> list[OneStep]:
    """The steps near one of those about the first, over widths near its own; none of one at once."""
    reach = 2.0 * _reach(of_error, first) / (PLACES_ABOUT - 1)
    places = np.round(step.at_mm + np.linspace(-reach, reach, PLACES_NEAR), 2).tolist()
    widths = [float(f"{step.width * part:.3g}") for part in NEAR_WIDTHS] if step.width else []
    return [OneStep(at, width) for width in widths for at in places]


def _able(of_error: StepsSeen, steps: Sequence[OneStep], rest: Sequence[OneStep]) -> list[OneStep]:
    """Those of some steps that may be beside the rest."""
    able = []
    for width, among in _by_width(steps):
        at = np.array([steps[index].at_mm for index in among])
        first, last = of_error.ends(width)
        may = (first <= at) & (at <= last)
        for other in rest:
            pairs = np.column_stack([at, np.full(len(at), other.at_mm)])
            may &= of_error.are_apart(pairs, (width + other.width) / 2.0)
        able += [steps[among[index]] for index in np.flatnonzero(may)]
    return able


def _by_width(steps: Sequence[OneStep]) -> list[tuple[float, list[int]]]:
    """Every width of some steps, with the indices of those that have it."""
    return [
        (width, [index for index, step in enumerate(steps) if step.width == width])
        for width in dict.fromkeys(step.width for step in steps)
    ]


def _columns(of_error: StepsSeen, steps: Sequence[OneStep]) -> Array:
    """The columns (M, k) of steps, those of one width made together."""
    columns = np.empty((len(of_error.scene.residual), len(steps)))
    for width, among in _by_width(steps):
        columns[:, among] = of_error.columns([steps[index].at_mm for index in among], width)
    return columns


def _left_with_each(
    of_error: StepsSeen, steps: Sequence[OneStep], rest: Sequence[OneStep], others: Sequence[ChainCandidate]
) -> Array:
    """What is left (k,) of the residual with each of some steps, beside the rest and others."""
    remainder = of_error.scene.remainders.beside(others)
    basis = orthonormal(without(remainder.basis, _columns(of_error, rest)))
    residual = without(basis, remainder.residual[:, None])[:, 0]
    columns = without(basis, without(remainder.basis, _columns(of_error, steps)))
    length = np.linalg.norm(columns, axis=0)
    onto = columns.T @ residual / np.where(length > 0.0, length, 1.0)
    return np.asarray(residual @ residual - onto**2)


def _cost(of_error: StepsSeen, steps: Sequence[OneStep], others: Sequence[ChainCandidate]) -> float:
    """Minus twice the logarithm of the likelihood of steps beside others."""
    freedom = of_error.scene.remainders.beside(others).degrees_of_freedom
    return freedom * float(np.log(_left_with_each(of_error, steps[:1], steps[1:], others)[0]))


def are_sharp(
    of_error: StepsSeen,
    steps: Sequence[ChainCandidate],
    companions: Sequence[ChainCandidate],
    others: Sequence[ChainCandidate],
) -> bool:
    """Whether no longer way in place of any of the steps, beside companions, is likelier: of one step alone beyond
    doubt. Several places, widths and companions together follow any smooth curve about as well as a free shape does: of
    them a longer way has to be less likely, at a price for all of them but the first."""
    shapes = list(map(_shape_of, steps))
    count = sum(len(shape.readings) + (shape.width > 0.0) for shape in shapes) + len(companions)
    least = (count - 1) * LIMIT if count > 1 else -LIMIT
    beside = [*others, *companions]
    return all(
        sharpness(of_error, each, [*beside, *(other for other in steps if other is not each)]) > least
        for each in steps
    )


def sharpness(of_error: StepsSeen, steps: ChainCandidate, others: Sequence[ChainCandidate]) -> float:
    """By how much, in twice the logarithm of a likelihood ratio, steps say more beside others than with a longer way in
    place of the least sharp of them; each of several goes over the width at which it says most: the one that all of
    them have may be too short for it."""
    shape, freedom = _shape_of(steps), of_error.scene.remainders.beside(others).degrees_of_freedom
    ratios = []
    for index, at_mm in enumerate(shape.readings):
        rest = [*shape.readings[:index], *shape.readings[index + 1 :]]
        left_over = partial(_left_over, of_error, OneStep(at_mm, shape.width), rest, others)
        width = min(_widths_of_one(of_error, at_mm, rest, shape.width), key=left_over)
        ratios.append(min(map(left_over, _longer_ways(of_error, at_mm, width))) / left_over(width))
    return freedom * float(np.log(min(ratios)))


def _shape_of(steps: ChainCandidate) -> Step:
    effect = steps.effect
    assert isinstance(effect, ChainEffect)
    assert isinstance(effect.shape, Step)
    return effect.shape


def _left_over(
    of_error: StepsSeen, step: OneStep, rest: Sequence[float], others: Sequence[ChainCandidate], way: float
) -> float:
    """What is left of the residual with a step that goes over another way than the rest."""
    return float(of_error.left_with([step.at_mm], rest, step.width, others, way)[0])


def _widths_of_one(of_error: StepsSeen, at_mm: float, rest: Sequence[float], width: float) -> list[float]:
    """The width of steps, and the longer ones over which one of several may go."""
    nearest = min((abs(at_mm - other_mm) for other_mm in rest), default=0.0)
    longer = {some * part for some in of_error.widths for part in NEAR_WIDTHS if some * part > width}
    able = [
        some
        for some in sorted(longer)
        if of_error.are_inside([at_mm], some) and nearest >= WIDTHS_APART * (some + width) / 2.0
    ]
    return [width, *able]


def _longer_ways(of_error: StepsSeen, at_mm: float, width: float) -> list[float]:
    """Ways in mm about a place that take at least two positions on either side off the levels of a step there."""
    at = of_error.positions.mean(axis=1)
    after = int(np.clip(np.searchsorted(at, at_mm), 1, len(at) - 1))
    gap = at[after] - at[after - 1]
    around = at[min(after + 1, len(at) - 1)] - at[max(after - 2, 0)]
    return [max(3.0 * gap, around, 2.0 * width) * part for part in LONGER_WAYS]
