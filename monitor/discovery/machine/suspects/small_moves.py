"""Small moves between stated places: whether the plays of axes turn over at them.

The balls of a plate that lies along the axes stand some hundredths of a millimetre aside from one to the next. The file
says where an axis stopped and not how the probe went there: a move of 10 to 100 µm may turn a play over, and may not.
Taken the wrong way, a play has the other sign at such touches, and parts of a free shape that nearly cancel follow
these. So where what follows moves is found, or more is left than noise leaves, both are asked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.free_parts import (
    is_free,
    of_parts_alone,
    parts_worth_keeping,
    priced,
    whole_basis,
)
from monitor.discovery.search.rivals import UNDECIDED
from monitor.discovery.search.scan import except_for
from monitor.effects import ChainEffect, Context, Effect
from monitor.effects.shape import DescribedShape
from monitor.effects.shapes.free import Follows, Free
from monitor.methods.chain.problem import ChainProblem


def without_small_moves(problem: ChainProblem) -> ChainProblem | None:
    """Return the problem with moves of less than 0.1 mm between stated places that turn nothing over; None where that
    is the same."""
    context = problem.context
    if not context.stops_are_stated:
        return None
    other = replace(context, stops_are_stated=False)
    return None if np.array_equal(other.travel, context.travel) else replace(problem, context=other)


def may_turn_nothing(scene: ChainScene, selected: Sequence[ChainCandidate], under: Fit) -> bool:
    """Return whether selected effects of which some follow moves, the free shapes among them with the parts that are
    worth keeping there, say no less beyond doubt ``under`` a fit in which small moves turn nothing over.

    Both are of the same readings and unknowns, of which moves are no part, in the same noise.
    """
    other_scene = scene_of(under, [candidate.variant for candidate in selected])
    candidates = list(other_scene.candidates)
    for index, candidate in enumerate(other_scene.candidates):
        if is_free(candidate) and follows_moves(candidate.effect, under.problem.context):
            symbol = error_of(candidate)
            parts = parts_worth_keeping(
                other_scene, whole_basis(other_scene, symbol, candidate), except_for(candidates, index)
            )
            candidates[index] = of_parts_alone(other_scene, symbol, parts) if parts else candidate
    return priced(other_scene, candidates) > priced(scene, selected) - UNDECIDED


def follows_moves(effect: Effect, context: Context) -> bool:
    """Return whether an effect follows how its axis came to its positions."""
    if not isinstance(effect, ChainEffect):
        return False
    shape = effect.shape
    if isinstance(shape, Free):
        return Follows.DIRECTION in shape.following(context, effect.term.joint)
    return isinstance(shape, DescribedShape) and shape.of_moves
