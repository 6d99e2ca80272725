"""Describes an effect of a curve: what it is, what usually causes it, what to do about it, where it is described."""

from __future__ import annotations

from dataclasses import replace

from monitor.effects.curve.effect import SEARCHED, SEQUENCE, CurveEffect
from monitor.effects.curve.shape import Subject
from monitor.effects.curve.shapes import shape_of
from monitor.effects.description import Description


def describe_curve(
    effect: CurveEffect, response: str, unit: str = "", *, clock: bool = False, searched: bool = False
) -> Description:
    """Describe an effect in words; ``unit`` is that of its input, ``clock`` says that the input is the time.

    Of a ``searched`` effect the number that it is searched for is left open.
    """
    subject = Subject(effect, response, unit, is_time=clock or effect.column == SEQUENCE)
    description = shape_of(effect).described(subject)
    if not searched:
        return description
    meaning = f"{effect.shape} of {effect.column} in {response}, its {SEARCHED[effect.shape]} searched"
    return replace(description, meaning=meaning)
