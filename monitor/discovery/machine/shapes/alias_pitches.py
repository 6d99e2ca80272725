"""Pitches that positions on a grid do not tell apart: between two of them a wave may go round once more.

A wave of 137 mm at positions 76 mm apart is one of 171 mm there, to the last digit of the readings. The longest leads;
those next to it are named with it. Positions between those of the grid tell them apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from monitor.discovery.machine.scene import ChainVariant, MachineEffect
from monitor.discovery.machine.shapes.variants import (
    BEND_PERIODS,
    FEWEST_PERIODS,
    SHORTEST_PITCH_MM,
    apparent_frequency,
    pitch_limits,
)
from monitor.discovery.search.candidate import Variant
from monitor.effects import ChainEffect, Context
from monitor.effects.shapes import Cyclic, parse_shape

# Pitches that differ by less than this part are one.
SAME_PITCH = 1e-3
# Cycles are one on a grid where over the travel they differ by less than this part of a period.
SAME_PERIODS = 0.1
# Besides the longest so many are named: with one turn less or more from each position to the next.
NEXT_TURNS = (-1.0, 1.0)


def as_it_appears(effect: MachineEffect, context: Context) -> list[ChainVariant]:
    """The cycle of the longer pitch for which positions on a grid take one below twice their step; none elsewhere."""
    if not isinstance(effect, ChainEffect) or not isinstance(effect.shape, Cyclic):
        return []
    shortest, _ = pitch_limits(context)[effect.joint.name]
    alike = _alike(effect, context, FEWEST_PERIODS)
    return [_with_pitch(effect, pitch) for pitch in alike[:1] if effect.shape.pitch < shortest]


def aliases_of(effect: MachineEffect, context: Context) -> list[ChainVariant]:
    """The cycles of other pitches that are one with a cycle at positions on a grid, the longest and the two next to it;
    none where positions lie anyhow, or where the longest has so few periods there that it is told as a bend."""
    if not isinstance(effect, ChainEffect) or not isinstance(effect.shape, Cyclic):
        return []
    pitch_found = effect.shape.pitch
    others = [
        pitch
        for pitch in _alike(effect, context, BEND_PERIODS)
        if abs(pitch / pitch_found - 1.0) > SAME_PITCH
    ]
    return [_with_pitch(effect, pitch) for pitch in others if pitch >= SHORTEST_PITCH_MM]


def _alike(effect: ChainEffect, context: Context, fewest: float) -> list[float]:
    """The pitches in mm as which a cycle appears at positions on a grid, the longest first; none elsewhere, or where
    that has fewer periods over the travel."""
    assert isinstance(effect.shape, Cyclic)
    shortest, travel = pitch_limits(context)[effect.joint.name]
    if not 0.0 < shortest < float("inf"):
        return []
    steps = 2.0 / shortest
    apparent = apparent_frequency(1.0 / effect.shape.pitch, steps)
    if apparent * travel < fewest:
        return []
    return [1.0 / apparent, *(1.0 / (steps + turn * apparent) for turn in NEXT_TURNS)]


def _with_pitch(effect: ChainEffect, pitch: float) -> ChainVariant:
    text = f"cyclic{pitch:.6g}mm"
    other = replace(effect, shape=parse_shape(text), shape_text=text)
    return Variant(other.text, other)


def grid_on_which_they_are_one(cycles: Sequence[ChainEffect], context: Context) -> float | None:
    """The step in mm of the grid of positions on which cycles of one axis are one; None where these lie on none, or
    where the cycles differ there."""
    pitches = [cycle.shape.pitch for cycle in cycles if isinstance(cycle.shape, Cyclic)]
    shortest, travel = pitch_limits(context)[cycles[0].joint.name]
    if len(pitches) < len(cycles) or not 0.0 < shortest < float("inf"):
        return None
    apparent = [apparent_frequency(1.0 / pitch, 2.0 / shortest) for pitch in pitches]
    return shortest / 2.0 if np.ptp(apparent) * travel < SAME_PERIODS else None
