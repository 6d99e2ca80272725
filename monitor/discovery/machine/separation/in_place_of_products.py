"""What errors of single axes do in place of a free shape with products of two axes.

A tilt of an axis moves what stands off by its arm, which other axes make longer: their positions times what the tilt is
at its own. So does a free shape of a displacement with a product of the two, in one part, and where nothing tells how
long the arm is (reflectors that a tracker follows on linear axes alone) the tilt itself shows no better. On the circles
of a ball bar an S-shaped straightness is such a product, too. Each of these has one shape, and is asked beside what the
free shape does of the position of its own axis.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.shapes.bends import bends_instead
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.free_parts import (
    is_free,
    of_parts,
    of_parts_alone,
    parts_worth_keeping,
    price_of_choices,
    whole_basis,
)
from monitor.discovery.search.evidence import weigh_beside
from monitor.effects import ChainEffect
from monitor.effects.drivers import Always
from monitor.effects.shapes.free import Follows, Free, axes_of_products
from monitor.machine import MOTION


def in_place_of_products(
    scene: ChainScene, candidate: ChainCandidate, others: Sequence[ChainCandidate], least: float
) -> Iterator[ChainCandidate]:
    """The free shapes or powers of errors of the axes that a free shape multiplies which, with what that does of its
    own position, are as likely as ``least``, all parts paid for, beside others."""
    effect = candidate.effect
    if not _is_free_motion(candidate):
        return
    assert isinstance(effect, ChainEffect)
    assert isinstance(effect.shape, Free)
    context, joint = scene.fit.problem.context, effect.term.joint
    axes = axes_of_products(context, joint, effect.shape.parts)
    if not axes:
        return
    follows = effect.shape.following(context, joint)
    of_position = np.array(effect.shape.parts)[follows != Follows.OTHERS] - 1
    rest = [of_parts_alone(scene, effect.term.symbol, of_position.tolist())] if len(of_position) else []
    of_rest = _likelihood(scene, rest, others)
    taken = {error_of(each) for each in (candidate, *others)}
    for symbol, shapes in _errors_of(scene, {joint, *axes}).items():
        if symbol in taken:
            continue
        beside = [*others, *rest]
        parts = parts_worth_keeping(scene, whole_basis(scene, symbol, shapes[0]), beside)
        alone = [of_parts(scene, symbol, parts, shapes, beside)] if parts else []
        instead = (alone, bends_instead(scene, symbol, -np.inf, beside))
        likelihoods = [_likelihood(scene, some, beside) if some else -np.inf for some in instead]
        best = int(np.argmax(likelihoods))
        if of_rest + likelihoods[best] >= least:
            yield from instead[best]


def _likelihood(
    scene: ChainScene, effects: Sequence[ChainCandidate], others: Sequence[ChainCandidate]
) -> float:
    """What the data say of effects together beside others, at the price of the choice of parts."""
    return sum(
        weigh_beside(scene, [each], [*others, *effects[:index]])[0].likelihood - price_of_choices(each)
        for index, each in enumerate(effects)
    )


def _is_free_motion(candidate: ChainCandidate) -> bool:
    """Whether a candidate is a free shape of a linear axis that follows no driver."""
    effect = candidate.effect
    return (
        is_free(candidate)
        and isinstance(effect, ChainEffect)
        and isinstance(effect.driver, Always)
        and effect.term.stage == MOTION
        and not effect.joint.turns
    )


def _errors_of(scene: ChainScene, joints: set[int]) -> dict[str, list[ChainCandidate]]:
    """The shapes of the catalogue of the error motions of some joints, by their error."""
    shapes: dict[str, list[ChainCandidate]] = {}
    for shape in scene.candidates:
        effect = shape.effect
        if (
            isinstance(effect, ChainEffect)
            and isinstance(effect.driver, Always)
            and effect.term.stage == MOTION
            and effect.term.joint in joints
            and not is_free(shape)
        ):
            shapes.setdefault(error_of(shape), []).append(shape)
    return shapes
