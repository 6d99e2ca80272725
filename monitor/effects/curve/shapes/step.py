"""``load_N:step~50``: a step."""

from __future__ import annotations

import numpy as np

from monitor.effects.curve.effect import CurveEffect, Inputs
from monitor.effects.curve.shape import CALIBRATION, DRIFT, Subject
from monitor.effects.description import Description
from monitor.records import Array


class Step:
    """The shape that is 1 above a value of the input, 0 up to it."""

    def columns(self, effect: CurveEffect, inputs: Inputs, value: float | None) -> Array:
        assert value is not None
        return np.asarray((inputs.numbers[effect.column] > value)[:, None], dtype=np.float64)

    def names(self, effect: CurveEffect, inputs: Inputs) -> tuple[str, ...]:
        return (effect.text,)

    def described(self, subject: Subject) -> Description:
        effect = subject.effect
        position = "" if effect.value is None else f" at {effect.value:.6g} {subject.unit}".rstrip()
        meaning = f"{subject.response} jumps {subject.course}{position}"
        if subject.is_time:
            return Description(
                meaning,
                "something was changed, repaired, adjusted, knocked or replaced at that moment",
                "find out what happened then; calibrate again and treat the parts separately",
                DRIFT,
            )
        return Description(
            meaning,
            "the instrument changes its range, or a part comes into contact",
            f"calibrate the ranges of {effect.column} on either side separately",
            CALIBRATION,
        )


SHAPES = {"step": Step()}
