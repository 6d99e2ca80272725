"""What a map does not follow between its points: errors that repeat along an axis in less than some of its steps."""

from __future__ import annotations

import numpy as np

from monitor.effects import ChainEffect
from monitor.effects.shapes.cyclic import Cyclic
from monitor.effects.shapes.sawtooth import Sawtooth
from monitor.reporting.between_points import BetweenPoints
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
    errors, first, unfollowed = mapped.errors, 0, []
    for effect in errors.effects:
        size = len(effect.parameters(errors.context))
        columns, first = slice(first, first + size), first + size
        if not isinstance(effect.shape, Cyclic | Sawtooth):
            continue
        low, high = mapped.ranges[effect.joint.name]
        spacing = (high - low) / (mapped.points - 1)
        if spacing * POINTS_A_PERIOD > effect.shape.pitch:
            unit: Unit = effect.term.unit
            largest = unit.to_display(_largest(errors, effect, columns, mapped.ranges))
            unfollowed.append(
                BetweenPoints(effect.text, effect.joint.name, effect.shape.pitch, spacing, largest, unit.name)
            )
    return tuple(unfollowed)


def _largest(
    errors: GeometricErrors, effect: ChainEffect, columns: slice, ranges: dict[str, tuple[float, float]]
) -> float:
    """The largest size of an effect along its axis, mm or rad."""
    chain, values = errors.chain, np.zeros_like(errors.estimate)
    values[columns] = errors.estimate[columns]
    positions = np.tile(middle(chain, ranges), (POINTS_OF_LINE, 1))
    joint = chain.index(effect.joint.name)
    positions[:, joint] = effect.joint.sign * np.linspace(*ranges[effect.joint.name], POINTS_OF_LINE)
    return float(np.abs(joint_errors(errors, positions, values)[0]).max())
