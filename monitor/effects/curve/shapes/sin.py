"""``month:sin12``: a cosine and a sine."""

from __future__ import annotations

import numpy as np

from monitor.effects.curve.calendar import calendar_entry
from monitor.effects.curve.effect import CurveEffect, Inputs
from monitor.effects.curve.shape import PERIODIC, Subject
from monitor.effects.description import Description
from monitor.records import Array


class Sine:
    """A cosine and a sine of a period."""

    def columns(self, effect: CurveEffect, inputs: Inputs, value: float | None) -> Array:
        assert value is not None
        phase = 2.0 * np.pi * inputs.numbers[effect.column] / value
        return np.column_stack([np.cos(phase), np.sin(phase)])

    def names(self, effect: CurveEffect, inputs: Inputs) -> tuple[str, ...]:
        return (f"{effect.text}.cos", f"{effect.text}.sin")

    def described(self, subject: Subject) -> Description:
        repeats = f"{subject.response} goes up and down {subject.course}, "
        if not subject.is_time:
            return Description(
                f"{repeats}{_period(subject.effect.value, subject.unit)}",
                "interpolation error of a scale or converter, or an eccentric part: it repeats with the input",
                "check scale, converter and bearings for this period; correct for the cycle",
                PERIODIC,
            )
        entry = calendar_entry(subject.effect.value, subject.unit)
        if entry is None:
            period = _period(subject.effect.value, subject.unit or "rows")
            cause = "something that comes back regularly: a rotating part, a controller, the mains, tides or weather"
        else:
            cause = entry.cause
            period = (
                f"repeating every {entry.name.removeprefix('a ')}"
                if entry.name.startswith("a ")
                else f"with a period of {entry.name}"
            )
        return Description(
            f"{repeats}{period}",
            cause,
            "record what has this period and correct for it, or shield the measurement from it",
            PERIODIC,
        )


def _period(value: float | None, unit: str) -> str:
    return (
        "with a period that is searched" if value is None else f"with a period of {value:.4g} {unit}".strip()
    )


SHAPES = {"sin": Sine()}
