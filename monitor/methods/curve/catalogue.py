"""The effects that the columns of a curve allow."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from monitor.effects.curve import SEARCHED, SEQUENCE, CurveEffect
from monitor.effects.curve.calendar import CALENDAR
from monitor.methods.curve.problem import CurveProblem

POWERS = (1, 2, 3)
#: A calendar period is looked for from so many cycles on.
FEWEST_CYCLES = 1.5
#: A loop is looked for where at least this share of the steps goes either way: series that only rise, one after the
#: other, fall once a series, and their "loop" would be the parabola itself.
LEAST_OF_A_LOOP = 0.1


def catalogue(problem: CurveProblem) -> Iterator[CurveEffect]:
    """Every effect that the columns name; those that the model has already are left out."""
    families = {effect.family for effect in problem.effects if effect.shape != "sin"}
    for name in problem.inputs.numbers:
        if name != SEQUENCE or (_clock(problem) == SEQUENCE and _order_is_time(problem)):
            yield from _powers(problem, name)
            yield from _calendar(problem, name)
            searched = [CurveEffect(name, shape, free=True) for shape in SEARCHED]
            yield from (effect for effect in searched if effect.family not in families)
            yield from (effect for effect in _loop(problem, name) if effect.family not in families)
    groups = [CurveEffect(name, "group") for name in problem.inputs.groups]
    yield from (effect for effect in groups if effect.family not in families)


def _clock(problem: CurveProblem) -> str:
    return problem.curve.time or SEQUENCE


def _powers(problem: CurveProblem, name: str) -> Iterator[CurveEffect]:
    """The powers of an input that the model lacks; the first power of time is a drift."""
    highest = max((effect.order for effect in problem.effects if effect.column == name), default=0)
    for power in POWERS:
        if power > highest:
            yield CurveEffect(name, "drift" if name == _clock(problem) and power == 1 else f"poly{power}")


def _loop(problem: CurveProblem, name: str) -> Iterator[CurveEffect]:
    """The hysteresis of an input that rises and falls, where the rows are in the order of measuring."""
    steps = np.diff(problem.inputs.numbers[name])
    clock = problem.inputs.numbers[_clock(problem)]
    in_order = not rows_are_sorted(problem) and bool(np.all(np.diff(clock) >= 0.0))
    rarer = min(np.count_nonzero(steps > 0.0), np.count_nonzero(steps < 0.0))
    turns_back = rarer >= LEAST_OF_A_LOOP * len(steps)
    if name != _clock(problem) and in_order and turns_back:
        yield CurveEffect(name, "loop")


def _calendar(problem: CurveProblem, name: str) -> Iterator[CurveEffect]:
    """The periods that need no search: those of the calendar that the rows can show."""
    if name != _clock(problem):
        return
    x = np.unique(problem.inputs.numbers[name])
    texts = {effect.text for effect in problem.effects}
    for length, _, _ in CALENDAR.get(problem.inputs.units.get(name, ""), ()):
        effect = CurveEffect(name, "sin", length)
        enough = (x[-1] - x[0]) / length >= FEWEST_CYCLES and len(x) >= 2 * (x[-1] - x[0]) / length
        if enough and effect.text not in texts:
            yield effect


def _order_is_time(problem: CurveProblem) -> bool:
    """Whether the order of the rows may say something of time that no input says: none of them only rises or falls."""
    steps = [np.diff(values) for name, values in problem.inputs.numbers.items() if name != SEQUENCE]
    monotone = any((step > 0.0).all() or (step < 0.0).all() for step in steps)
    return not monotone and not rows_are_sorted(problem)


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
        changes = 1 + sum(before != after for before, after in pairwise(both))
        if changes == len(set(both)) and len(set(both)) > len(np.unique(blocks)):
            blocks = np.unique(both, return_inverse=True)[1]
            nested += 1
    return nested > 1
