"""What no finding can be, in any search: an effect that others nearly cancel, or one whose searched value the readings
do not determine.

Two effects that are hardly told apart can each be fitted with a size hundreds of times as large as the error that it
takes away; a period or a time constant of any size describes what is a straight line or a step for these readings.
"""

from __future__ import annotations

import math

#: Two effects that all but cancel are each hundreds of times as large as the error that they take away; the effects of
#: the trial of power are at most 32 times as large.
LARGEST_RATIO = 100.0
#: A value whose uncertainty exceeds half of it, as neighbours on the grid of time constants differ, is not determined.
LARGEST_RELATIVE_U = 0.5


def nearly_cancelled(peak: float, removed: float, readings: int, ratio: float = LARGEST_RATIO) -> bool:
    """Return whether an effect is many times as large as what it takes of the error.

    ``peak`` is its largest displacement, ``removed`` the sum of squares that it takes away beside all others, over so
    many ``readings``, in the square of the unit of ``peak``.
    """
    return peak > ratio * math.sqrt(removed / readings)


def is_determined(value: float, u: float) -> bool:
    """Return whether the readings determine a searched value, from its standard uncertainty; no where it is NaN."""
    return u < LARGEST_RELATIVE_U * abs(value)
