"""Small moves between stated places: whether the plays of axes turn over at them.

The balls of a plate that lies along the axes stand some hundredths of a millimetre aside from one to the next. The file
says where an axis stopped and not how the probe went there: a move of 10 to 100 µm may turn a play over, and may not.
Taken the wrong way, a play has the other sign at such touches, and parts of a free shape that nearly cancel follow
these. So where what follows moves is found, or more is left than noise leaves, both are asked.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

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


def follows_moves(effect: Effect, context: Context) -> bool:
    """Return whether an effect follows how its axis came to its positions."""
    if not isinstance(effect, ChainEffect):
        return False
    shape = effect.shape
    if isinstance(shape, Free):
        return Follows.DIRECTION in shape.following(context, effect.term.joint)
    return isinstance(shape, DescribedShape) and shape.of_moves
