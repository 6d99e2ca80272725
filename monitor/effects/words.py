"""Describes an effect physically: what it is, what usually causes it, what to do about it, and where it is described.

The meaning is put together from the term, its shape and its driver; the most specific of the three explains it.
"""

from __future__ import annotations

from monitor.effects.description import Description, Explanation, described
from monitor.effects.driver import DescribedDriver
from monitor.effects.effect import ArtefactEffect, InstrumentEffect, ParsedEffect, TurnEffect
from monitor.effects.joint_error import JointError
from monitor.effects.shape import DescribedShape


def describe(effect: ParsedEffect) -> Description:
    """Describe an effect in words."""
    if isinstance(effect, ArtefactEffect | InstrumentEffect | TurnEffect):
        return effect.change.described(_driver_phrase(effect))
    error = JointError(effect.term, effect.joint)
    explanations: list[Explanation | None] = [error.explanation()]
    phrase = f", of shape {effect.shape_text}"
    if isinstance(effect.shape, DescribedShape):
        phrase = effect.shape.phrase(error)
        explanations.append(effect.shape.explanation(error))
    if isinstance(effect.driver, DescribedDriver):
        explanations.append(effect.driver.explanation(error))
    explanation = max(filter(None, explanations), key=lambda explanation: explanation.specificity)
    return described(error.meaning + phrase + _driver_phrase(effect), explanation)


def _driver_phrase(effect: ParsedEffect) -> str:
    if isinstance(effect.driver, DescribedDriver):
        return effect.driver.phrase
    return f", driven by {effect.driver_text}"
