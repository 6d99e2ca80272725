"""``load_N:knee~50``: another slope beyond a value of the input."""

from __future__ import annotations

import numpy as np

from monitor.effects.curve.effect import CurveEffect, Inputs
from monitor.effects.curve.shape import CALIBRATION, DRIFT, Subject
from monitor.effects.description import Description
from monitor.records import Array


class Knee:
    """The shape that is 0 up to a value of the input and grows with the distance beyond it."""

    def columns(self, effect: CurveEffect, inputs: Inputs, value: float | None) -> Array:
        assert value is not None
        return np.asarray(np.maximum(inputs.numbers[effect.column] - value, 0.0)[:, None], dtype=np.float64)

    def names(self, effect: CurveEffect, inputs: Inputs) -> tuple[str, ...]:
        return (effect.text,)

    def described(self, subject: Subject) -> Description:
        effect = subject.effect
        position = "" if effect.value is None else f" from {effect.value:.6g} {subject.unit}".rstrip() + " on"
        meaning = f"{subject.response} has another slope {subject.course}{position}"
        if subject.is_time:
            return Description(
                meaning,
                "a drift began, stopped or changed its rate at that moment",
                "find out what happened then; correct for the drift on either side separately",
                DRIFT,
            )
        return Description(
            meaning,
            "a stop or a second spring comes into play, a range begins, or the sensor saturates",
            f"use a calibration function with a slope for each part of {effect.column}",
            CALIBRATION,
        )


SHAPES = {"knee": Knee()}
