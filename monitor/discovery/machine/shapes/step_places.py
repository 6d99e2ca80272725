"""Where the steps of a scale lie: the readings between which the data leave their places open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.shapes.refine import LIMIT
from monitor.discovery.machine.shapes.scale_steps import StepsOfError, steps_of
from monitor.discovery.machine.shapes.steps_seen import POSITIONS_BEYOND
from monitor.discovery.machine.shapes.tables import SAME_POSITION
from monitor.effects.shapes import Step
from monitor.records import Array

# So many readings each at which a step over a width may begin and end are tried, then so many again among those that
# are likely; from end to end it goes over so many times the width that was told at most.
ENDS_OVER_WIDTH = 65
MOST_WIDTHS = 4.0


@dataclass(frozen=True)
class Between:
    """The readings in mm between which a step lies with all of its way, which is ``width`` long where it says most.

    ``middles`` are those between which its middle may lie, None where nothing but the readings is known. Points between
    may err by ``part`` of its size.
    """

    low: float
    high: float
    width: float = 0.0
    middles: tuple[float, float] | None = None
    part: float = 1.0

    @property
    def middle(self) -> tuple[float, float]:
        """From where to where in mm the middle of the step may lie."""
        return self.middles or (self.low, self.high)


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

    A step at once lies in gaps between positions, in those next to it at least. Of one over a width any reading may be
    where it begins and where it ends: positions within the width tell both, and the width is known no better.
    """
    intervals = []
    for index, at_mm in enumerate(shape.readings):
        rest = [*shape.readings[:index], *shape.readings[index + 1 :]]
        around = nearest_readings(steps.readings, at_mm, shape.width)
        if shape.width:
            intervals.append(_over_any_width(steps, at_mm, rest, around, others))
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


def _over_any_width(
    steps: StepsOfError,
    at_mm: float,
    rest: Sequence[float],
    around: Between,
    others: Sequence[ChainCandidate],
) -> Between:
    """Where a step over a width may begin and end; ``around`` are the nearest readings outside of the told one."""
    width = around.width
    told_ends = at_mm - width / 2.0, at_mm + width / 2.0
    reach = (MOST_WIDTHS - 1.0) * width
    # At the level beyond either end stand positions enough, and no end is among those of its neighbours.
    positions = steps.positions.mean(axis=1)
    beyond = min(POSITIONS_BEYOND, len(positions))
    levels = positions[beyond - 1], positions[-beyond]
    before = [other_mm + width / 2.0 for other_mm in rest if other_mm < at_mm]
    after = [other_mm - width / 2.0 for other_mm in rest if other_mm > at_mm]
    low = min(max(around.low - reach, levels[0], *before), told_ends[0])
    high = max(min(around.high + reach, levels[1], *after), told_ends[1])
    begins = ends = np.linspace(low, high, ENDS_OVER_WIDTH)
    freedom = steps.scene.remainders.beside(others).degrees_of_freedom
    for _ in range(2):
        begins, ends = np.union1d(begins, told_ends[0]), np.union1d(ends, told_ends[1])
        remaining = steps.left_with_ways(begins, ends, rest, width, others)
        way = ends - begins[:, None]
        remaining[way > MOST_WIDTHS * width] = np.inf
        if not np.isfinite(remaining.min()):
            return around
        able = freedom * np.log(remaining / remaining.min()) < LIMIT
        able[begins == told_ends[0], ends == told_ends[1]] = True
        begin, end = np.nonzero(able)
        likely = begins[begin], ends[end]
        begins, ends = _about(begins, begin), _about(ends, end)
    middles = np.mean(likely, axis=0)
    return Between(
        float(min(likely[0].min(), around.low)),
        float(max(likely[1].max(), around.high)),
        width,
        (float(middles.min()), float(middles.max())),
        _apart(likely, told_ends),
    )


def _about(readings: Array, able: npt.NDArray[np.intp]) -> Array:
    """Readings from the neighbour before the first of some to that after the last."""
    low, high = max(int(able.min()) - 1, 0), min(int(able.max()) + 1, len(readings) - 1)
    return np.linspace(readings[low], readings[high], ENDS_OVER_WIDTH)


def _apart(ways: tuple[Array, Array], told_ends: tuple[float, float]) -> float:
    """How far a way from 0 to 1 from one of the ``told_ends`` to the other is at most from those between others."""
    begins, ends = ways
    at = np.stack([begins, ends, *(np.full_like(begins, end) for end in told_ends)])
    of_way = np.clip((at - begins) / (ends - begins), 0.0, 1.0)
    of_told = np.clip((at - told_ends[0]) / (told_ends[1] - told_ends[0]), 0.0, 1.0)
    return float(np.abs(of_way - of_told).max())


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
