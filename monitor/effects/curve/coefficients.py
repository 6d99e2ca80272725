"""The columns of a curve's effect, and the names and units of its coefficients."""

from __future__ import annotations

from monitor.effects.curve.effect import SEARCHED, SEQUENCE, CurveEffect, Inputs
from monitor.effects.curve.shapes import shape_of
from monitor.records import Array


def curve_columns(effect: CurveEffect, inputs: Inputs, value: float | None = None) -> Array:
    """Return the columns (n, k) of an effect, at ``value`` instead of that of the effect where one is given.

    A polynomial has its own power alone, in the unit of the input; a group one column a label but the first.
    Raises EffectError for a formula that is not finite.
    """
    value = effect.value if value is None else value
    assert value is not None or effect.shape not in SEARCHED, (
        f"the value of {effect.text} has not been searched yet"
    )
    return shape_of(effect).columns(effect, inputs, value)


def coefficient_names(effect: CurveEffect, inputs: Inputs) -> tuple[str, ...]:
    """Return a name for each coefficient of an effect."""
    return shape_of(effect).names(effect, inputs)


def coefficient_unit(effect: CurveEffect, inputs: Inputs, response: str) -> str:
    """Return the unit of the coefficients: that of the response, over a power of that of the input."""
    of_input = inputs.units.get(effect.column, "")
    if effect.column == SEQUENCE and (effect.order or effect.shape == "knee"):
        of_input = "row"
    # Beyond a knee the response has another slope.
    order = 1 if effect.shape == "knee" else effect.order
    if not order or not of_input:
        return response or "1"
    power = {1: "", 2: "²", 3: "³"}.get(order, f"^{order}")
    return f"{response or '1'}/{of_input}{power}"
