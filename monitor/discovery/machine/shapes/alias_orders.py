"""Orders of gears that positions on a grid do not tell apart: between two of them a wave may go round once more.

An error that repeats 12 times a turn is one that repeats 18, 42 or 72 times at positions 12 degrees apart, to the last
digit of the readings. The one found leads; the next ones are named with it. Positions between those of the grid, or a
stated ratio, tell them apart.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from monitor.discovery.machine.scene import ChainVariant, MachineEffect
from monitor.discovery.machine.shapes.gears import HIGHEST, LOWEST, WINDOW_STEP, window_of
from monitor.discovery.search.candidate import Variant
from monitor.effects import ChainEffect, Context
from monitor.effects.shapes import Harmonic, parse_shape
from monitor.effects.shapes.free import HARMONICS
from monitor.records import Array

# Below this part of a wave another one leaves as much as half of it to see.
ALIKE = 0.7
# A number of waves that positions do not see is told to so many of its order.
FINE_STEP = 0.025
# Orders so near to a whole number are that: of teeth that go round.
WHOLE = 0.1
# So many orders are named besides the one found, the most alike first, and of these the lowest.
MOST_ORDERS = 4
# Orders that are closer are one.
SAME_ORDER = 2.0


def aliases_of_order(effect: MachineEffect, context: Context) -> list[ChainVariant]:
    """The waves of other orders that are all but one with the wave of a gear at the positions of its axis; none where
    these lie anyhow, of the low orders of tables, which need no gear, and of errors that no gear makes."""
    if not isinstance(effect, ChainEffect) or not isinstance(effect.shape, Harmonic):
        return []
    order_found, joint = float(effect.shape.order), effect.joint
    is_low = order_found < LOWEST or (order_found <= HARMONICS and order_found.is_integer())
    if is_low or not joint.turns or effect.term.component != 3 + joint.main:
        return []
    alike: dict[float, float] = {}
    for wave, part in _unseen(context.positions[:, effect.term.joint]):
        for order in (abs(wave - order_found), wave + order_found):
            if LOWEST <= order <= HIGHEST and abs(order - order_found) > SAME_ORDER:
                whole = abs(order - round(order)) < WHOLE
                alike.setdefault(float(round(order)) if whole else round(order, 3), part)
    most_alike = sorted(alike, key=lambda order: (-round(alike[order], 2), order))[:MOST_ORDERS]
    return [_of_order(effect, order) for order in most_alike]


def _unseen(position: Array) -> list[tuple[float, float]]:
    """The numbers of waves a turn that positions (n,) in rad hardly see, and to which part they are alike there."""
    waves = np.arange(0.0, 2.0 * HIGHEST, WINDOW_STEP)
    window = window_of(position, waves)
    # The first maximum is that of no wave at all.
    beyond = int(np.argmax(window < ALIKE))
    inner = np.arange(beyond + 1, len(waves) - 1)
    peaks = inner[
        (window[inner] > ALIKE) & (window[inner] >= window[inner - 1]) & (window[inner] > window[inner + 1])
    ]
    unseen = []
    for wave in waves[peaks].tolist():
        near = np.arange(wave - WINDOW_STEP, wave + WINDOW_STEP + FINE_STEP / 2.0, FINE_STEP)
        parts = window_of(position, near)
        unseen.append((round(float(near[np.argmax(parts)]), 3), float(parts.max())))
    return unseen


def _of_order(effect: ChainEffect, order: float) -> ChainVariant:
    text = f"harmonic{order:.6g}"
    other = replace(effect, shape=parse_shape(text), shape_text=text)
    return Variant(other.text, other)
