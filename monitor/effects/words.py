"""Describes an effect physically: what it is, what usually causes it, what to do about it, and where it is described.

The meaning is put together from the term, its shape and its driver; the most specific of the three explains it.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from monitor.effects.description import Description, Explanation, described
from monitor.effects.driver import DescribedDriver
from monitor.effects.effect import ArtefactEffect, ChainEffect, InstrumentEffect, ParsedEffect, TurnEffect
from monitor.effects.joint_error import JointError
from monitor.effects.shape import DescribedShape
from monitor.effects.shapes.free import Follows
from monitor.effects.shapes.harmonic import Harmonic


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


def describe_searched(effect: ParsedEffect) -> Description:
    """Describe an effect that stands for those of its kind, whose places are searched."""
    plain = describe(effect)
    return replace(plain, meaning=f"{plain.meaning}; explain searches the places, of every error of the axis")


def describe_free(effect: ChainEffect, follows: Collection[Follows]) -> Description:
    """Describe an effect of free shape that ``follows`` more than the position of its axis, or that alone."""
    name = effect.joint.name
    direction, others = (each in follows for each in (Follows.DIRECTION, Follows.OTHERS))
    on = f"position and direction of {name}" if direction else f"the position of {name}"
    alone = "" if direction or others else " alone"
    beside = ", and where the other axes stand" if others else ""
    plain = describe(effect)
    return replace(plain, meaning=f"{plain.meaning}: it depends on {on}{alone}{beside}")


def describe_bend(effect: ParsedEffect) -> Description:
    """Describe an effect of whose periods its axis turned so few that it is a smooth bend of any cause."""
    described_alone = describe(effect)
    if not isinstance(effect, ChainEffect) or not isinstance(effect.shape, Harmonic):
        return described_alone
    name = effect.joint.name
    return replace(
        described_alone,
        cause=f"over this part of a turn no more than a smooth bend of {name}: flexure under gravity, an offset or a "
        f"tilt of axis or encoder; or {described_alone.cause}",
        remedy=f"measure over more of the turn of {name} before anything is mended; then, where it comes back, "
        f"{described_alone.remedy}",
    )


def _driver_phrase(effect: ParsedEffect) -> str:
    if isinstance(effect.driver, DescribedDriver):
        return effect.driver.phrase
    return f", driven by {effect.driver_text}"
