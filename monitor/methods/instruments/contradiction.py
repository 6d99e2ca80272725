"""Readings that no errors of this machine explain: those of another one, of other signs, points or units."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from monitor.methods.instruments.part import Part
from monitor.records import Array

# Residuals of directions of more than a tenth of a radian are no errors of this mount.
CONTRADICTS = 0.1
# Residuals of lengths beyond this part of the travel, and beyond a millimetre, are those of another machine: the limit
# of the tracker.
CONTRADICTS_TRAVEL, LEAST_CONTRADICTION = 0.02, 1.0


def wrong_direction(parts: Iterable[Part], sigma: Array, vectors: Array) -> str | None:
    """The first setup of directions that point elsewhere after the fit, in words; ``sigma`` and ``vectors`` (n, d)."""
    for part in parts:
        if part.reading.name != "direction":
            continue
        # A direction that points the other way has no component across: it is looked at by itself.
        weighted = np.isfinite(sigma[part.at]).all(axis=1)
        off = np.linalg.norm(vectors[part.at][weighted], axis=1) / 1000.0
        if len(off) and float(np.sqrt(np.mean(off**2))) > CONTRADICTS:
            return (
                f"setup {part.id}: after the fit the directions are off by {np.sqrt(np.mean(off**2)):.2g} rad; "
                "check the signs and directions of the axes, tool_direction and the outer frame"
            )
    return None


def wrong_length(parts: Iterable[Part], sigma: Array, vectors: Array, travel: float) -> str | None:
    """The first setup of lengths whose readings are off by more than any machine's errors, in words; ``travel`` mm is
    how far the machine moved."""
    limit = max(LEAST_CONTRADICTION, CONTRADICTS_TRAVEL * travel)
    for part in parts:
        numbers = vectors[part.at][np.isfinite(sigma[part.at])]
        off = float(np.sqrt(np.mean(numbers**2))) if len(numbers) else 0.0
        if not part.reading.angular and off > limit:
            return (
                f"setup {part.id}: after the fit its readings are off by {off:.3g} mm; check the points, "
                "the directions and the signs of the axes, and the unit of the readings"
            )
    return None
