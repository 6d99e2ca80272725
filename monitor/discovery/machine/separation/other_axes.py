"""The free shape of an axis in place of what another one does that goes with it.

Where what is touched or looked at stays in place while a head or a table turns, the linear axes have one place for
every angle. What one of them does as a function of its place, a turning axis may do as a function of its angle, and the
other way round: of each the free shape of the other is asked, at the price of its parts. At a dozen poses two turning
axes go together as well: a table's wave with its play is a free shape of the axis that tilts it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.free_parts import is_free, of_parts, parts_worth_keeping, whole_basis
from monitor.effects import ChainEffect, Context
from monitor.effects.drivers import Always
from monitor.machine import MOTION

# Angles and places closer than this, in rad and mm, are the same.
SAME_ANGLE, SAME_PLACE = 1e-3, 0.5


def free_of_other_axes(
    scene: ChainScene, candidate: ChainCandidate, others: Sequence[ChainCandidate]
) -> Iterator[ChainCandidate]:
    """The free shapes of errors of turning axes in place of an error motion of a linear one beside others, and of
    linear ones in place of that of a turning one, where these go with each other; in place of a free shape of a turning
    axis those of the other turning ones."""
    effect, context = candidate.effect, scene.fit.problem.context
    if not _is_motion(candidate):
        return
    assert isinstance(effect, ChainEffect)
    kinds = _kinds_asked(candidate, effect, context)
    taken = {error_of(other) for other in others}
    shapes: dict[str, list[ChainCandidate]] = {}
    for shape in scene.candidates:
        other = shape.effect
        if not _is_motion(shape) or is_free(shape) or not isinstance(other, ChainEffect):
            continue
        moves = float(np.ptp(context.positions[:, other.term.joint])) > 0.0
        is_asked = other.joint.turns in kinds and other.joint != effect.joint
        if moves and is_asked and error_of(shape) not in taken:
            shapes.setdefault(error_of(shape), []).append(shape)
    for symbol, of_error in shapes.items():
        parts = parts_worth_keeping(scene, whole_basis(scene, symbol, of_error[0]), others)
        if parts:
            yield of_parts(scene, symbol, parts, of_error, others)


def _kinds_asked(candidate: ChainCandidate, effect: ChainEffect, context: Context) -> set[bool]:
    """Whether other turning axes are asked (True), linear ones (False), or both."""
    turns = effect.joint.turns
    of_other_kind = {not turns} if _go_together(context) else set()
    return of_other_kind | ({True} if turns and is_free(candidate) else set())


def _is_motion(candidate: ChainCandidate) -> bool:
    """Whether a candidate is an error motion of an axis that follows no driver."""
    effect = candidate.effect
    return (
        isinstance(effect, ChainEffect) and isinstance(effect.driver, Always) and effect.term.stage == MOTION
    )


def _go_together(context: Context) -> bool:
    """Whether linear axes that move have one place for all angles of the turning ones, at each target and setup."""
    turns = np.array([joint.turns for joint in context.chain.joints])
    angles, places = context.positions[:, turns], context.positions[:, ~turns]
    if not angles.size or not places.size or np.ptp(angles, axis=0).max() == 0.0:
        return False
    of_target = np.unique(context.target, return_inverse=True)[1]
    of_setup = 0 * of_target if context.instruments is None else context.instruments.setup
    poses = np.column_stack([np.round(angles / SAME_ANGLE), of_target, of_setup])
    pose = np.unique(poses, axis=0, return_inverse=True)[1].reshape(-1)
    order = np.argsort(pose, kind="stable")
    starts = np.flatnonzero(np.diff(pose[order], prepend=-1))
    spread = np.maximum.reduceat(places[order], starts) - np.minimum.reduceat(places[order], starts)
    # Of as many poses as there are rows none says that it has one place.
    return len(starts) < len(pose) and bool(spread.max() < SAME_PLACE < np.ptp(places, axis=0).max())
