"""Says in which unit readings or positions seem to be, by the gain at which a fit ends."""

from __future__ import annotations

import numpy as np

from monitor.records import Array
from monitor.units import UNIT_WORDS, mistaken_for_mm

# Units are further apart than a fifth; so far off is a gain that a fit of such readings ends at.
NEAR_UNIT = 0.2


def mistaken_unit(gain: float, gains: Array, *, has_bar: bool) -> str:
    """The unit that positions or the readings of instruments seem to be in under a gain, or, of a plan that
    ``has_bar``, a bar's length where all ``gains`` (k,) that are told are that one, in words; else empty."""
    # A tip truly moves by 1 + gain of the positions that were typed.
    of_positions = mistaken_for_mm(1.0 / (1.0 + gain), NEAR_UNIT)
    alike = not has_bar or np.ptp(gains) < NEAR_UNIT * (1.0 + gain)
    of_lengths = mistaken_for_mm(1.0 + gain, NEAR_UNIT) if alike else ()
    lengths = "the length of its scale bar was" if has_bar else "its readings were"
    mistakes = [f"{lengths} {UNIT_WORDS[unit]}" for unit in of_lengths]
    mistakes += [f"its positions were {UNIT_WORDS[unit]}" for unit in of_positions]
    return f"; it looks as if {' or '.join(mistakes)}" if mistakes else ""
