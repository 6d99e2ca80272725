"""Where a plate that grows is held, and how well that is known: its growth about any point is one about another and a
shift that follows the same driver, so that the place is the ratio of two sizes that are linear."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.search.amplitudes import amplitudes
from monitor.discovery.search.candidate import Variant
from monitor.effects import InstrumentEffect
from monitor.effects.instrument.plate import PlateExpansion
from monitor.records import Array

# The shift of a unit of growth is that between two places so far apart.
ARM_MM = 1000.0


@dataclass(frozen=True)
class HeldPlace:
    """The reading in mm of a linear axis where a plate is held, and its standard uncertainty."""

    axis: str
    reading: float
    u: float


def held_at(
    scene: ChainScene, plate: ChainCandidate, names: Sequence[str], readings: Array, tries: int = 1
) -> ChainCandidate:
    """Return a plate that is held at readings (d,) in mm of some axes."""
    effect = plate.effect
    assert isinstance(effect, InstrumentEffect)
    assert isinstance(effect.change, PlateExpansion)
    held = tuple((name, round(reading, 1)) for name, reading in zip(names, readings.tolist(), strict=True))
    moved = replace(effect, change=replace(effect.change, held=held))
    return scene_of(scene.fit, [Variant(moved.text, moved, tries)]).candidates[0]


def with_shifts(
    scene: ChainScene, plate: ChainCandidate, names: Sequence[str], readings: Array
) -> ChainCandidate:
    """Return the plate held at readings (d,) with a column more per axis: what changes where it is held 1 m beside."""
    about = held_at(scene, plate, names, readings)
    columns = [about.columns]
    for axis in range(len(names)):
        beside = readings.copy()
        beside[axis] += ARM_MM
        columns.append(held_at(scene, plate, names, beside).columns - about.columns)
    return replace(about, columns=np.concatenate(columns, axis=1))


def held_place(
    scene: ChainScene, plate: ChainCandidate, others: Sequence[ChainCandidate]
) -> tuple[HeldPlace, ...]:
    """Return where a plate is held by axis, beside others; nothing for what is none, or grows about its middle."""
    effect = plate.effect
    if not isinstance(effect, InstrumentEffect) or not isinstance(effect.change, PlateExpansion):
        return ()
    names, readings = [name for name, _ in effect.change.held], [value for _, value in effect.change.held]
    if not names:
        return ()
    together = with_shifts(scene, plate, names, np.array(readings))
    fitted = amplitudes(scene, [*others, together])
    growth = abs(float(fitted.estimate[-len(names) - 1]))
    spread = np.sqrt(np.diag(fitted.covariance)[-len(names) :]) * ARM_MM / growth
    return tuple(map(HeldPlace, names, readings, spread.tolist()))
