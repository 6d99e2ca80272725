"""Free shapes that a model has already: what is left of their errors, and what others say beside them.

Some parts of a flexible basis follow a shape as far as readings asked for them, and no basis follows a sharp step
between two of its nodes. Effects of other errors mimic what is left, as they mimic what an entry of the catalogue
leaves of an unknown shape: where its error still stands out beside them, everything that it could do in any shape is
taken out before they are believed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.free_parts import price_of_parts
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.scan import ScanResult, findings_of
from monitor.discovery.search.scene import family_count
from monitor.effects import ChainEffect
from monitor.effects.drivers import Always
from monitor.effects.shapes.free import Free
from monitor.machine import MOTION


def may_be_mimics(scene: ChainScene, selected: Sequence[ChainCandidate], rate: float) -> bool:
    """Whether what was selected may mimic what a free shape of the model leaves of its error: where this still stands
    out beside it, and where another error is told in a free shape, which follows whatever is left."""
    if not selected or not _in_any_shape(scene):
        return False
    return any(map(price_of_parts, selected)) or bool(not_followed(scene, selected, rate))


def beside_free_shapes(scene: ChainScene) -> ChainScene:
    """The scene in which the errors that the model has in a free shape are taken for granted in any shape, and are not
    searched in others."""
    wholes = _in_any_shape(scene)
    errors = {error_of(whole) for whole in wholes}
    more = without(orthonormal(scene.shared), np.concatenate([whole.columns for whole in wholes], axis=1))
    others = [each for each in scene.candidates if not _is_shape_of(each, errors)]
    return replace(
        scene, shared=np.concatenate([scene.shared, orthonormal(more)], axis=1), candidates=(*others,)
    )


def under_the_model(
    scene: ChainScene, searched: ChainScene, result: ChainScan
) -> tuple[ChainScene, ChainScan]:
    """What was found in the ``searched`` scene, weighed in that of the model as it is, with the candidates of both."""
    of_the_model = {id(each) for each in scene.candidates}
    more = [each for each in searched.candidates if id(each) not in of_the_model]
    scene = replace(scene, candidates=(*scene.candidates, *more))
    return scene, ScanResult(findings_of(scene, result.candidates))


def not_followed(scene: ChainScene, selected: Sequence[ChainCandidate], rate: float) -> tuple[str, ...]:
    """The errors that the model has in a free shape and of which some shape was selected as well, or still stands out
    beside what was selected."""
    families = family_count(scene)
    unfollowed = []
    for whole in _in_any_shape(scene):
        shapes = [each for each in scene.candidates if each.visible and _is_shape_of(each, {error_of(whole)})]
        others = [each for each in selected if not _is_shape_of(each, {error_of(whole)})]
        weighed = weigh_beside(scene, [whole, *shapes], others)
        if min(evidence.p_value for evidence in weighed) * families <= rate:
            unfollowed.append(error_of(whole))
    return tuple(unfollowed)


def _in_any_shape(scene: ChainScene) -> tuple[ChainCandidate, ...]:
    """The errors of the model's free shapes, in any shape."""
    errors: dict[str, ChainEffect] = {}
    for effect in scene.fit.problem.added:
        if (
            isinstance(effect, ChainEffect)
            and isinstance(effect.shape, Free)
            and isinstance(effect.driver, Always)
        ):
            errors.setdefault(effect.term.symbol, replace(effect, shape=Free(), shape_text="free"))
    variants = [Variant(symbol, effect) for symbol, effect in errors.items()]
    return scene_of(scene.fit, variants).candidates if variants else ()


def _is_shape_of(candidate: ChainCandidate, errors: set[str]) -> bool:
    """Whether a candidate is a shape of one of these errors that follows no driver."""
    effect = candidate.effect
    return (
        isinstance(effect, ChainEffect)
        and isinstance(effect.driver, Always)
        and effect.term.stage == MOTION
        and error_of(candidate) in errors
    )
