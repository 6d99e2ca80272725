"""The numerical tolerance that belongs to a number of significant digits (JCGM 101:2008 7.9.2)."""

from __future__ import annotations

from decimal import ROUND_HALF_EVEN, Context, Decimal

import numpy as np

from monitor.exceptions import DataError
from monitor.records import Array


def numerical_tolerance(value: float, digits: int = 2) -> float:
    """Return delta = 10^l / 2, where ``value`` rounded to ``digits`` digits is c 10^l with c an integer of so many.

    0.00035 has 35e-5 with two digits, so delta is 0.000005. A value that rounds up to the next decade takes
    that decade's l (0.996 is 1.0 with two digits: delta 0.05). Raises DataError for a value that is not
    positive and finite or ``digits`` below 1.
    """
    if digits < 1:
        raise DataError(f"digits must be at least 1, but is {digits}")
    if not (value > 0.0 and np.isfinite(value)):
        raise DataError(f"a numerical tolerance needs a positive, finite value, but the value is {value}")
    # Decimal(repr) rounds what is printed, so that 0.35 is not taken for 0.34999...
    rounded = Context(prec=digits, rounding=ROUND_HALF_EVEN).create_decimal(Decimal(repr(float(value))))
    return 0.5 * 10.0 ** (rounded.adjusted() - digits + 1)


def tolerances_of(values: Array, digits: int = 2) -> Array:
    """``numerical_tolerance`` of each of ``values`` (m,); zero for a quantity without uncertainty."""
    return np.array([numerical_tolerance(float(v), digits) if v > 0.0 else 0.0 for v in values])
