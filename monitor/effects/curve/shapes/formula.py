"""``formula(log(load_N))``: typed by the user over the columns."""

from __future__ import annotations

from monitor.effects.curve.effect import CurveEffect, Inputs
from monitor.effects.curve.shape import FIT, Subject
from monitor.effects.description import Description
from monitor.effects.formula import Formula
from monitor.records import Array


class FormulaOfColumns:
    """A formula; the coefficient multiplies it."""

    def columns(self, effect: CurveEffect, inputs: Inputs, value: float | None) -> Array:
        return Formula(effect.column).evaluate(inputs.numbers, inputs.count)[:, None]

    def names(self, effect: CurveEffect, inputs: Inputs) -> tuple[str, ...]:
        return (effect.text,)

    def described(self, subject: Subject) -> Description:
        return Description(
            f"{subject.response} follows {subject.effect.column}",
            "what the user knows of it",
            "as the user sees fit",
            FIT,
        )


SHAPES = {"formula": FormulaOfColumns()}
