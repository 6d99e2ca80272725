"""Describes an effect of a curve: what it is, what usually causes it, what to do about it, where it is described."""

from __future__ import annotations

from monitor.effects.curve.effect import SEQUENCE, CurveEffect
from monitor.effects.curve.shape import Subject
from monitor.effects.curve.shapes import shape_of
from monitor.effects.description import Description


def describe_curve(effect: CurveEffect, response: str, unit: str = "", *, clock: bool = False) -> Description:
    """Describe an effect in words; ``unit`` is that of its input, ``clock`` says that the input is the time."""
    subject = Subject(effect, response, unit, is_time=clock or effect.column == SEQUENCE)
    return shape_of(effect).described(subject)
