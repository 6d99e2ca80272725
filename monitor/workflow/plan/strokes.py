"""Where the axes of a machine may stand in a plan."""

from __future__ import annotations

from monitor.machine import Chain
from monitor.records import Array, Campaign

# Linear axes without a stroke in the machine file may go this much further than they went.
STRETCH = 1.25


def strokes_of(
    campaign: Campaign, chain: Chain, positions: Array
) -> tuple[dict[str, tuple[float, float]], ...]:
    """Positions that axes may take: of the rotary axes with a stroke in the file, and of all linear ones."""
    rotary: dict[str, tuple[float, float]] = {}
    linear: dict[str, tuple[float, float]] = {}
    for index, joint in enumerate(chain.joints):
        settings = campaign.machine.axes.get(joint.name)
        stroke = None if settings is None else settings.stroke
        if stroke is not None:
            ends = sorted((joint.sign * stroke[0], joint.sign * stroke[1]))
            (rotary if joint.turns else linear)[joint.name] = (ends[0], ends[1])
        elif not joint.turns:
            low, high = float(positions[:, index].min()), float(positions[:, index].max())
            middle, half = (low + high) / 2.0, (high - low) / 2.0 * STRETCH
            linear[joint.name] = (middle - half, middle + half)
    return rotary, linear
