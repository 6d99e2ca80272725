"""``time_s:exp~120``: an exponential approach or growth."""

from __future__ import annotations

import numpy as np

from monitor.effects.curve.effect import CurveEffect, Inputs
from monitor.effects.curve.shape import CALIBRATION, DRIFT, Subject
from monitor.effects.description import Description
from monitor.records import Array


class Exponential:
    """The shape exp(-x/constant), x from the end at which it is 1, so that nothing overflows; negative: it grows."""

    def columns(self, effect: CurveEffect, inputs: Inputs, value: float | None) -> Array:
        assert value is not None
        x = inputs.numbers[effect.column]
        start = x.min() if value > 0 else x.max()
        return np.asarray(np.exp(-(x - start) / value)[:, None], dtype=np.float64)

    def names(self, effect: CurveEffect, inputs: Inputs) -> tuple[str, ...]:
        return (effect.text,)

    def described(self, subject: Subject) -> Description:
        effect = subject.effect
        verb = "settles" if effect.value is None or effect.value > 0 else "grows"
        meaning = f"{subject.response} {verb} exponentially {subject.course}"
        if subject.is_time:
            return Description(
                meaning,
                "warming up, creep, or charging after the start",
                "wait until it has settled before measuring, or correct for it with its time constant",
                DRIFT,
            )
        return Description(
            meaning,
            "a quantity that follows an exponential law (thermistor, absorption, leakage)",
            f"use the exponential law of {effect.column} in the calibration function",
            CALIBRATION,
        )


SHAPES = {"exp": Exponential()}
