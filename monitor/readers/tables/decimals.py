"""Writes the decimal of a file's unit that reads back as the same internal double."""

from __future__ import annotations

import math
from collections.abc import Callable

from monitor.units import Unit


def decimal_in(unit: Unit) -> Callable[[float], str]:
    """Return a function that writes an internal value in the unit, with the fewest digits that read back the same.

    Multiplying by the unit's factor rounds, so some doubles are the image of no decimal: then the nearest.
    """

    def write(internal: float) -> str:
        if unit.factor == 1.0:
            return repr(internal)
        near = unit.to_display(internal)
        candidates = [float(f"{near:.{digits}g}") for digits in range(1, 18)]
        candidates += [near, math.nextafter(near, math.inf), math.nextafter(near, -math.inf)]
        return repr(next((c for c in candidates if unit.to_internal(c) == internal), near))

    return write
