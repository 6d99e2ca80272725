"""``load_N:loop``: hysteresis, a loop that closes at both ends of the input."""

from __future__ import annotations

import numpy as np

from monitor.effects.curve.effect import CurveEffect, Inputs
from monitor.effects.curve.shape import FIT, Subject
from monitor.effects.description import Description
from monitor.records import Array


class Loop:
    """The direction of the last change of the input, times a parabola that is 1 in the middle and 0 at both ends of it.

    Rows are in the order of measuring. The lens shape is that of elastic hysteresis in a load cycle of full range
    (Rayleigh's law of small cycles); a loop of another shape is described in part.
    """

    def columns(self, effect: CurveEffect, inputs: Inputs, value: float | None) -> Array:
        x = inputs.numbers[effect.column]
        middle, half = (x.max() + x.min()) / 2.0, max(float(np.ptp(x)) / 2.0, 1e-300)
        return np.asarray((directions(x) * (1.0 - ((x - middle) / half) ** 2))[:, None], dtype=np.float64)

    def names(self, effect: CurveEffect, inputs: Inputs) -> tuple[str, ...]:
        return (effect.text,)

    def described(self, subject: Subject) -> Description:
        name = subject.effect.column
        return Description(
            f"{subject.response} depends on whether {name} rose or fell before: a loop that closes at both ends",
            "hysteresis of an elastic body, a magnet, a seal or a joint with friction",
            f"calibrate rising and falling {name} separately, or count half of the loop's width as an uncertainty",
            FIT,
        )


def directions(x: Array) -> Array:
    """The sign (n,) of the last change of an input before or at every row; that of the first change before it."""
    steps = np.sign(np.diff(x))
    changed = np.flatnonzero(steps)
    if not len(changed):
        return np.zeros(len(x))
    last = np.searchsorted(changed, np.arange(len(x)) - 1, side="right") - 1
    return np.asarray(steps[changed[np.maximum(last, 0)]])


SHAPES = {"loop": Loop()}
