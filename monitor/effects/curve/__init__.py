"""Effects of a curve: one response over its inputs. The same language, ``column:shape``, for a load cell or a clock.

| written | what |
| --- | --- |
| ``load_N`` or ``load_N:poly1`` | in proportion to an input |
| ``load_N:poly2`` ... ``poly9`` | a power of it; lower powers that the model lacks come along: no origin matters |
| ``date:drift`` | in proportion to the time, or to ``sequence``, the number of the row |
| ``month:sin12`` | a cosine and a sine of exactly this period |
| ``month:sin~44.3`` | the same with a period that is estimated, near this value; ``month:sin`` searches it |
| ``time_s:exp~120``, ``exp`` | exp(-x/constant), x from the smallest value on; a negative constant grows |
| ``load_N:step~50``, ``step`` | a step at this value |
| ``load_N:knee~50``, ``knee`` | another slope beyond this value |
| ``load_N:loop`` | hysteresis: by the direction of the last change, closing at both ends |
| ``probe`` or ``probe:group`` | every group has its own mean |
| ``formula(log(load_N))`` | typed by the user over the columns |
"""

from monitor.effects.curve.coefficients import coefficient_names, coefficient_unit, curve_columns
from monitor.effects.curve.effect import (
    PLACED,
    SEARCHED,
    SEQUENCE,
    CurveEffect,
    Inputs,
    group_names,
    inputs_of,
)
from monitor.effects.curve.language import parse_base, parse_curve_effect

__all__ = [
    "PLACED",
    "SEARCHED",
    "SEQUENCE",
    "CurveEffect",
    "Inputs",
    "coefficient_names",
    "coefficient_unit",
    "curve_columns",
    "group_names",
    "inputs_of",
    "parse_base",
    "parse_curve_effect",
]
