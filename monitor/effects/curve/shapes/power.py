"""``load_N:poly1`` to ``poly9``, and ``date:drift``: a power of an input."""

from __future__ import annotations

import numpy as np

from monitor.effects.curve.effect import CurveEffect, Inputs
from monitor.effects.curve.shape import CALIBRATION, DRIFT, FIT, Subject
from monitor.effects.description import Description, power_of
from monitor.records import Array

TEMPERATURES = ("degC", "K", "degF")


class Power:
    """A power of the input alone, in its unit."""

    def columns(self, effect: CurveEffect, inputs: Inputs, value: float | None) -> Array:
        x = inputs.numbers[effect.column]
        return np.asarray(x[:, None] ** effect.order, dtype=np.float64)

    def names(self, effect: CurveEffect, inputs: Inputs) -> tuple[str, ...]:
        return (effect.column,) if effect.order == 1 else (effect.text,)

    def described(self, subject: Subject) -> Description:
        if subject.is_time:
            return _drift(subject)
        name, order = subject.effect.column, subject.effect.order
        if subject.unit in TEMPERATURES:
            return Description(
                f"{subject.response} changes {power_of(order)} the temperature {name}",
                "temperature acts on what is measured or on the instrument",
                f"keep {name} steady, or correct by its coefficient",
                CALIBRATION,
            )
        if order == 1:
            return Description(
                f"{subject.response} changes in proportion to {name}",
                f"{name} acts on what is measured, and the base model leaves it out",
                f"put {name} into the calibration function, or keep it steady",
                CALIBRATION,
            )
        return Description(
            f"{subject.response} is not straight: it changes {power_of(order)} {name}",
            "the sensor is not linear: its elastic body, its element or its amplifier",
            f"use a calibration function with the {'square' if order == 2 else f'power {order}'} of {name}",
            FIT,
        )


def _drift(subject: Subject) -> Description:
    order = subject.effect.order
    verb = "drifts steadily" if order == 1 else f"drifts at a changing rate (power {order})"
    return Description(
        f"{subject.response} {verb} {subject.course}",
        "ageing of what is measured or of the instrument, wear, or a slow change of the surroundings",
        "correct for the drift, shorten the calibration interval, and predict when its limit is reached",
        DRIFT,
    )


SHAPES = {name: Power() for name in ("drift", *(f"poly{order}" for order in range(1, 10)))}
