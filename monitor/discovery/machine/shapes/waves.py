"""Waves by their names: what of a free shape of a turning axis is a cosine and a sine of some periods a turn.

Two errors of a table together (run-out and a play that builds up) go into one free shape, and so does a gear of five
teeth: an entry that the catalogue has, or that has a name, is told by it, and what is left keeps its free shape.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.variants import part_of_period
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.products import Products
from monitor.effects import ChainEffect, parse_effect
from monitor.effects.shapes.free import HARMONICS, Free

#: Waves of fewer periods a turn are in the catalogue, or are the motion itself.
FEWEST_PERIODS = 4
#: A shape that takes more names than these has none: a wave that does not repeat each turn is three and a remainder.
MOST_NAMES = 2
#: The free shape with some parts, from 0, beside others; and the score of effects at their price beside others.
OfParts = Callable[[Sequence[int]], ChainCandidate]
Score = Callable[[Sequence[ChainCandidate]], float]


def waves_instead(
    scene: ChainScene, free: ChainCandidate, taken: set[str], of_parts: OfParts, score: Score
) -> list[ChainCandidate]:
    """The waves of a free shape by their names, and what is left of it as a free shape; none where it has no waves, or
    where they say less at their price. ``taken`` are families that are selected already."""
    effect = free.effect
    if not isinstance(effect, ChainEffect) or not isinstance(effect.shape, Free) or not effect.joint.turns:
        return []
    waves = _able_waves(scene, error_of(free), taken)
    # Selected part by part a wave may have become a mixture of others: each alone is asked, too.
    instead = [[wave] for wave in waves.values()] + _in_names(effect.shape.parts, waves, of_parts)
    best = max(instead, key=score, default=[])
    return best if best and score(best) >= score([free]) else []


def _in_names(
    parts: Sequence[int], waves: dict[int, ChainCandidate], of_parts: OfParts
) -> list[list[ChainCandidate]]:
    """The parts of a free shape, from 1, as ``waves`` by order and what is left of them as a free shape; none where
    they have none, or too many."""
    orders = sorted({(part + 1) // 2 for part in parts if part <= 2 * HARMONICS})
    rest = [part - 1 for part in parts if part > 2 * HARMONICS]
    if orders and set(orders) <= set(waves) and len(orders) + bool(rest) <= MOST_NAMES:
        return [[*(waves[order] for order in orders), *([of_parts(rest)] if rest else [])]]
    whole = [order for order in orders if {2 * order - 1, 2 * order} <= set(parts)]
    if len(whole) != 1 or whole[0] not in waves:
        return []
    # One wave has its cosine and its sine: single parts of others belong to what it leaves.
    other_parts = [part - 1 for part in parts if (part + 1) // 2 != whole[0]]
    return [[waves[whole[0]], of_parts(other_parts)]]


def _able_waves(scene: ChainScene, symbol: str, taken: set[str]) -> dict[int, ChainCandidate]:
    """The waves of an error by their order that the data see, that repeat over the travel, and that are not taken."""
    context = scene.fit.problem.context
    waves = {order: _wave(scene, f"{symbol}:harmonic{order}") for order in range(1, HARMONICS + 1)}
    return {
        order: wave
        for order, wave in waves.items()
        if wave.family not in taken and wave.visible and part_of_period(wave.effect, context) is None
    }


def _wave(scene: ChainScene, text: str) -> ChainCandidate:
    """The wave of that name, as the catalogue has it where it does."""
    in_catalogue = next((candidate for candidate in scene.candidates if candidate.family == text), None)
    if in_catalogue is not None:
        return in_catalogue
    return scene_of(
        scene.fit, [Variant(text, parse_effect(text, scene.fit.problem.context.chain))]
    ).candidates[0]


def many_periods(scene: ChainScene, shapes: Sequence[ChainCandidate]) -> tuple[ChainCandidate, ...]:
    """The waves of an error with more periods a turn than its ``shapes`` have, up to those of the flexible basis."""
    effect = shapes[0].effect
    if not isinstance(effect, ChainEffect) or not effect.joint.turns:
        return ()
    present = {shape.family for shape in shapes}
    symbol, chain = error_of(shapes[0]), scene.fit.problem.context.chain
    texts = [f"{symbol}:harmonic{order}" for order in range(FEWEST_PERIODS, HARMONICS + 1)]
    variants = [Variant(text, parse_effect(text, chain)) for text in texts if text not in present]
    return scene_of(scene.fit, variants).candidates


def worth_keeping(products: Products, parts: Sequence[int], freedom: int, price: float) -> list[int]:
    """Those of some parts of a basis that are worth their price beside the others, in their order.

    Parts are selected one after the other: the first may be a mixture of two that were selected later, and says
    nothing beside them.
    """
    worthy = list(parts)
    while len(worthy) > 1:
        remaining = [products.left_by([part for part in worthy if part != out]) for out in worthy]
        least = int(np.argmin(remaining))
        if freedom * np.log(remaining[least] / max(products.left_by(worthy), 1e-300)) >= price:
            break
        del worthy[least]
    return worthy
