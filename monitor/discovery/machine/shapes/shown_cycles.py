"""What no cycle of a linear axis can be: one that its positions hardly show, or one steeper than any screw or way.

Where every position lies where a sine passes through zero, a cycle of any size leaves a little, and what it leaves
follows what is read of the axis and so the noise of the readings.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.search.plausible import nearly_cancelled
from monitor.effects import ChainEffect
from monitor.effects.shapes import Cyclic
from monitor.records import Array

# A cycle that is seen at all of its phases takes a fifth to two thirds of its amplitude, one of a setup among twenty a
# tenth of that.
LARGEST_RATIO = 30.0
# What an axis moves off per way travelled: 30 um that repeat every 2 mm have 0.094, 10 um every 5 mm have 0.013.
STEEPEST = 0.1


def is_cycle(candidate: ChainCandidate) -> bool:
    """Return whether an effect repeats along a linear axis."""
    effect = candidate.effect
    return isinstance(effect, ChainEffect) and isinstance(effect.shape, Cyclic)


def is_told(symbol: str, effects: Sequence[ChainCandidate]) -> bool:
    """Return whether an error is among effects in another shape than a cycle, beside which what else it does is
    asked."""
    return any(error_of(effect) == symbol and not is_cycle(effect) for effect in effects)


def is_shown(cycle: ChainCandidate, coefficients: Array, removed: float) -> bool:
    """Return whether the positions show a cycle with such coefficients (2,), which takes the sum of squares ``removed``
    (mm2) of the residual, and it is no steeper than what a machine does."""
    effect = cycle.effect
    assert isinstance(effect, ChainEffect)
    assert isinstance(effect.shape, Cyclic)
    # Cosine and sine together have the length of the whole wave, wherever its zeros are.
    of_unit = float(np.sqrt(np.einsum("ndk,ndk->n", cycle.raw, cycle.raw).max(initial=0.0)))
    amplitude = float(np.linalg.norm(coefficients)) * of_unit
    if 2.0 * np.pi * amplitude > STEEPEST * effect.shape.pitch:
        return False
    return not nearly_cancelled(amplitude, removed, cycle.fit.readings, LARGEST_RATIO)
