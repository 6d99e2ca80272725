"""Coverage intervals of single outputs from Monte Carlo values (JCGM 101:2008 7.7)."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from monitor.exceptions import DataError
from monitor.records import Array

IntervalForm = Literal["symmetric", "shortest"]


def coverage_interval(
    values: Array, p: float = 0.95, form: IntervalForm = "symmetric"
) -> tuple[float, float]:
    """The interval that holds a part ``p`` of ``values`` (n,), in their unit.

    ``symmetric`` leaves (1 - p)/2 on either side (7.7.2); ``shortest`` is the narrowest of all (7.7.4), the
    one to use for a skewed output. Raises DataError where n p leaves no value outside.
    """
    ordered = np.sort(np.asarray(values, dtype=np.float64).ravel())
    if not 0.0 < p < 1.0:
        raise DataError(f"the coverage probability p must lie between 0 and 1, but is {p}")
    count = len(ordered)
    inside = math.floor(p * count + 0.5)
    if inside >= count or inside < 1:
        raise DataError(f"{count} values are too few for an interval of probability {p}")
    if form == "symmetric":
        low = math.floor(0.5 * (count - inside) + 0.5)
        return float(ordered[low - 1 if low > 0 else 0]), float(ordered[low - 1 + inside])
    if form == "shortest":
        widths = ordered[inside:] - ordered[:-inside]
        low = int(np.argmin(widths))
        return float(ordered[low]), float(ordered[low + inside])
    raise DataError(f"no form '{form}' of an interval; there are symmetric and shortest")
