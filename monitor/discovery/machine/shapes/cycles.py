"""A cycle in place of a free shape or a table of a linear axis: a wave of one pitch is a cosine and a sine.

Pitches of positioning errors are in the catalogue; those of the other errors of an axis, and longer ones, are asked for
where its error has no shape of the catalogue: rollers that recirculate, bolts of a rail, the machining of a way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.shapes.edges import edges_of
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.free_parts import PRICE, priced
from monitor.discovery.machine.shapes.long_waves import is_at_longest, long_wave
from monitor.discovery.machine.shapes.refine import refine
from monitor.discovery.machine.shapes.variants import (
    FEWEST_PERIODS,
    SHORTEST_PITCH_MM,
    longest_pitch,
    pitches_over,
    resolvable,
)
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.rivals import UNDECIDED
from monitor.effects import ChainEffect, parse_effect
from monitor.effects.shapes.free import Free
from monitor.effects.shapes.nodes import Nodes

Score = Callable[[Sequence[ChainCandidate]], float]


def cycle_instead(
    scene: ChainScene, free: ChainCandidate, others: Sequence[ChainCandidate], score: Score
) -> list[ChainCandidate]:
    """The cycle of a searched pitch, the teeth or the steps, alone, that say beside others at least as much at their
    price as a free shape or a table of a linear axis; none where none do, or where it is none of these."""
    effect = free.effect
    if not isinstance(effect, ChainEffect) or not isinstance(effect.shape, Free | Nodes):
        return []
    cycle = best_cycle(scene, free, others)
    edges = edges_of(scene, free)
    worth = priced(scene, others) + score([free]) + 2.0 * PRICE - UNDECIDED
    able = edges if cycle else replace(edges, teeth=None)
    edged = able.beside(others, [], worth, with_steps=True)
    best = max((some for some in (cycle, *edged) if some), key=score, default=[])
    return best if best and score(best) >= score([free]) else []


def best_cycle(
    scene: ChainScene, shape: ChainCandidate, others: Sequence[ChainCandidate]
) -> list[ChainCandidate]:
    """The cycle of a searched pitch, alone, that says most beside others of the error of which a candidate is a shape;
    none where that turns, or travels too little for any. Of pitches up to half of the travel, and of longer ones where
    the wave is the whole of its error."""
    effect = shape.effect
    if not isinstance(effect, ChainEffect) or effect.joint.turns:
        return []
    context = scene.fit.problem.context
    travel = float(np.ptp(context.positions[:, effect.term.joint]))
    if travel < FEWEST_PERIODS * SHORTEST_PITCH_MM:
        return []
    symbol = error_of(shape)
    texts = [f"{symbol}:cyclic{pitch:.6g}mm" for pitch in pitches_over(travel, longest_pitch(travel))]
    variants = [Variant(f"{symbol}:cyclic", parse_effect(text, context.chain), len(texts)) for text in texts]
    cycles = [
        cycle for cycle in scene_of(scene.fit, resolvable(variants, context)).candidates if cycle.visible
    ]
    weighed = weigh_beside(scene, cycles, others)
    if not weighed:
        return []
    best = refine(scene, [*others, weighed[0].candidate], len(others)).candidate
    short = [] if is_at_longest(best, longest_pitch(travel)) else [best]
    both = [*short, *long_wave(scene, shape, others)]
    return [evidence.candidate for evidence in weigh_beside(scene, both, others)][:1]
