"""What a map does not follow between its points: errors that repeat along an axis in less than some of its steps; and
what it cannot know: where a step lies between readings that tell no better."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from monitor.effects import ChainEffect
from monitor.effects.shapes import Step
from monitor.effects.shapes.cyclic import Cyclic
from monitor.effects.shapes.sawtooth import Sawtooth
from monitor.records import Array
from monitor.reporting.between_points import LEAST_STEP, BetweenPoints, StepPlace
from monitor.uncertainty.geometric_errors import GeometricErrors, joint_errors
from monitor.uncertainty.volumetric import middle
from monitor.units import Unit
from monitor.workflow.volumetric.error_map import VolumetricMap

#: With eight points a period the largest of them is at least 0.92 of the amplitude of a wave.
POINTS_A_PERIOD = 8
#: Points of the line on which the size of an error is looked for: more than any period has that is told.
POINTS_OF_LINE = 4001


def between_points(mapped: VolumetricMap) -> tuple[BetweenPoints, ...]:
    """The periodic errors of a map that lie between its points."""
    errors, unfollowed = mapped.errors, []
    for effect, columns in _with_columns(errors):
        if not isinstance(effect.shape, Cyclic | Sawtooth):
            continue
        low, high = mapped.ranges[effect.joint.name]
        spacing = (high - low) / (mapped.points - 1)
        unit: Unit = effect.term.unit
        largest = unit.to_display(float(np.abs(_along(mapped, effect, errors.estimate, columns)).max()))
        if largest and spacing * POINTS_A_PERIOD > effect.shape.pitch:
            unfollowed.append(
                BetweenPoints(effect.text, effect.joint.name, effect.shape.pitch, spacing, largest, unit.name)
            )
    return tuple(unfollowed)


def step_places(mapped: VolumetricMap) -> tuple[StepPlace, ...]:
    """Where the steps of a map may lie, as the readings of the campaign leave it open."""
    errors, places = mapped.errors, []
    for effect, columns in _with_columns(errors):
        if not isinstance(effect.shape, Step):
            continue
        axis, sign = effect.term.joint, effect.joint.sign
        zero = None if mapped.error.datum is None else sign * float(mapped.error.datum[axis])
        # A driver may have several columns for each step.
        each = (columns.stop - columns.start) // len(effect.shape.readings)
        unit: Unit = effect.term.unit
        for number, between in enumerate(mapped.steps[effect.text]):
            start = columns.start + number * each
            of_step = slice(start, start + each)
            size = float(np.ptp(_along(mapped, effect, errors.estimate, of_step)))
            if unit.to_display(size) >= LEAST_STEP:
                low, high = between.low, between.high
                # Of a driver that differs between runs the run of the map has one multiplier alone.
                by_coefficient = np.array(
                    [
                        float(
                            np.ptp(_along(mapped, effect, np.ones(columns.stop), slice(column, column + 1)))
                        )
                        for column in range(start, start + each)
                    ]
                )
                places.append(
                    StepPlace(
                        parameter=errors.names[start + int(np.argmax(by_coefficient))],
                        axis=effect.joint.name,
                        low_mm=low,
                        high_mm=high,
                        size=unit.to_display(size),
                        unit=unit.name,
                        zero_between=zero is not None and low < zero < high,
                        width_mm=between.width or None,
                        middle_mm=between.middle if between.width else None,
                        error=unit.to_display(size * between.part) if between.width else None,
                    )
                )
    return tuple(places)


def _with_columns(errors: GeometricErrors) -> Iterator[tuple[ChainEffect, slice]]:
    """The effects of a machine, each with its part of the coefficients."""
    first = 0
    for effect in errors.effects:
        last = first + len(effect.parameters(errors.context))
        yield effect, slice(first, last)
        first = last


def _along(mapped: VolumetricMap, effect: ChainEffect, coefficients: Array, columns: slice) -> Array:
    """The errors of all joints along the axis of an effect that some of the ``coefficients`` make, mm and rad."""
    errors, ranges = mapped.errors, mapped.ranges
    chain, values = errors.chain, np.zeros_like(errors.estimate)
    values[columns] = coefficients[columns]
    positions = np.tile(middle(chain, ranges), (POINTS_OF_LINE, 1))
    joint = chain.index(effect.joint.name)
    positions[:, joint] = effect.joint.sign * np.linspace(*ranges[effect.joint.name], POINTS_OF_LINE)
    return joint_errors(errors, positions, values)[0]
