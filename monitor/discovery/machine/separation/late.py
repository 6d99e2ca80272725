"""How large an effect is that is taken to follow a temperature at once, where it may follow it late.

What follows late moves by less than the temperature asks of it. Taken as at once it is told too small, and where a
temperature hardly turns within a run nothing in the readings says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, MachineEffect, scene_of
from monitor.discovery.machine.shapes.variants import that_lag
from monitor.discovery.machine.sizes import size_of
from monitor.discovery.search.amplitudes import amplitudes
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.scan import except_for
from monitor.effects import Context
from monitor.effects.drivers import Channel, LaggedTemperature, SettlingDriver


@dataclass(frozen=True)
class SizeIfLate:
    """The ``amplitude`` of an effect, with its standard uncertainty ``u``, if it follows late by a time constant."""

    time_constant_s: float
    amplitude: float
    u: float


def is_at_once(effect: MachineEffect, other: MachineEffect) -> bool:
    """Return whether an effect follows at once what another one follows late."""
    return (
        isinstance(other.driver, LaggedTemperature)
        and isinstance(effect.driver, Channel)
        and effect.driver.name == other.driver.channel
    )


def sizes_if_late(
    scene: ChainScene, selected: Sequence[ChainCandidate], index: int, least: float
) -> tuple[SizeIfLate, ...]:
    """The sizes of the effect at an index if it followed its temperature late, the shortest time constant first, of
    those that are as likely as ``least`` beside the others; empty where it follows none that changes within a run."""
    context: Context = scene.fit.problem.context
    others = except_for(selected, index)
    late = scene_of(scene.fit, that_lag([selected[index].effect], context)).candidates
    sizes = []
    for evidence in weigh_beside(scene, [each for each in late if each.visible], others):
        driver = evidence.candidate.effect.driver
        if evidence.likelihood < least or not isinstance(driver, SettlingDriver):
            continue
        together = amplitudes(scene, [evidence.candidate, *others])
        count = evidence.candidate.columns.shape[1]
        size = size_of(evidence.candidate, together.estimate[:count], together.covariance[:count, :count])
        sizes.append(SizeIfLate(driver.time_constant_s or 0.0, size.amplitude, size.u))
    return tuple(sorted(sizes, key=lambda each: each.time_constant_s))
