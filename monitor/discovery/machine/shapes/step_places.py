"""Where the steps of a scale lie: the readings between which the data leave their places open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.shapes.refine import LIMIT
from monitor.discovery.machine.shapes.scale_steps import StepsOfError, steps_of
from monitor.discovery.machine.shapes.tables import SAME_POSITION
from monitor.effects.shapes import Step
from monitor.records import Array

# So many places about a step over a width, from the nearest positions outside of it and one width further, and so many
# again among those where it may lie.
PLACES_OVER_WIDTH = 97


@dataclass(frozen=True)
class Between:
    """The readings in mm between which a step lies, with the way ``width`` over which it goes."""

    low: float
    high: float
    width: float = 0.0

    @property
    def middle(self) -> tuple[float, float]:
        """From where to where in mm the middle of the step may lie."""
        return self.low + self.width / 2.0, self.high - self.width / 2.0


def steps_between(
    scene: ChainScene, candidate: ChainCandidate, others: Sequence[ChainCandidate]
) -> tuple[Between, ...]:
    """The readings between which each step of an effect lies beside others; none where it has none."""
    steps = steps_of(scene, candidate)
    shape = None if steps is None else steps.effect.shape
    return places_of_steps(steps, shape, others) if steps is not None and isinstance(shape, Step) else ()


def places_of_steps(
    steps: StepsOfError, shape: Step, others: Sequence[ChainCandidate]
) -> tuple[Between, ...]:
    """The readings between which each step of a shape lies beside others: all at which it would not be 3.84 (twice
    the logarithm of a likelihood ratio) less likely than where it says most.

    A step at once lies in gaps between positions, in those next to it at least. Positions tell the place of one
    over a width also where they are within it.
    """
    intervals = []
    for index, at_mm in enumerate(shape.readings):
        rest = [*shape.readings[:index], *shape.readings[index + 1 :]]
        around = nearest_readings(steps.readings, at_mm, shape.width)
        if shape.width:
            low, high = _likely(steps, at_mm, rest, shape.width, around, others)
            intervals.append(Between(low - shape.width / 2.0, high + shape.width / 2.0, shape.width))
            continue
        excess = _excess(steps, [*map(float, steps.middles), at_mm], rest, shape.width, others)
        ends = steps.gaps[excess[:-1] < LIMIT]
        intervals.append(Between(float(ends.min(initial=around.low)), float(ends.max(initial=around.high))))
    return tuple(intervals)


def _excess(
    steps: StepsOfError,
    places: Sequence[float],
    rest: Sequence[float],
    width: float,
    others: Sequence[ChainCandidate],
) -> Array:
    """Twice the logarithm of the likelihood ratio (k,) of a step at each of some places to the best of them."""
    freedom = steps.scene.remainders.beside(others).degrees_of_freedom
    remaining = steps.left_with(places, rest, width, others)
    return np.asarray(freedom * np.log(remaining / remaining.min()))


def _likely(
    steps: StepsOfError,
    at_mm: float,
    rest: Sequence[float],
    width: float,
    around: Between,
    others: Sequence[ChainCandidate],
) -> tuple[float, float]:
    """From where to where in mm the middle of a step over a width may lie; ``around`` are the nearest readings
    outside of it."""
    first, last = float(steps.positions[0, 0]), float(steps.positions[-1, 1])
    low, high = max(around.low - width, first), min(around.high + width, last)
    places = np.union1d([*np.linspace(low, high, PLACES_OVER_WIDTH), at_mm], steps.middles)
    for _ in range(2):
        excess = _excess(steps, places.tolist(), rest, width, others)
        able = np.flatnonzero((excess < LIMIT) | (places == at_mm))
        low, high = places[max(able[0] - 1, 0)], places[min(able[-1] + 1, len(places) - 1)]
        within = float(places[able[0]]), float(places[able[-1]])
        places = np.union1d(np.linspace(low, high, PLACES_OVER_WIDTH), [at_mm])
    return within


def nearest_readings(measured: Array, at_mm: float, width: float) -> Between:
    """The nearest readings in mm before and after the width over which a step at a place goes; the end of the width
    where none was ``measured``. A step at a position itself has those of its neighbours: half of it is there."""
    begin, end = at_mm - width / 2.0, at_mm + width / 2.0
    if not width:
        measured = np.sort(measured)
        first = np.flatnonzero(np.diff(measured, prepend=-np.inf) > SAME_POSITION)
        for position in np.split(measured, first[1:]):
            if position[0] <= at_mm <= position[-1] and np.ptp(position) < 2.0 * SAME_POSITION:
                measured = measured[(measured < position[0]) | (measured > position[-1])]
    below, above = measured[measured <= begin], measured[measured >= end]
    low = float(below.max()) if below.size else begin
    high = float(above.min()) if above.size else end
    return Between(low, high, width)
