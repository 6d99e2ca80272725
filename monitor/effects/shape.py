"""What a shape is: how an effect depends on the position of its axis.

A shape is one small class with a ``pattern`` that its name matches, ``columns`` (n, k) of a position and the ``unit``
of its coefficients. Another one is one more file of ``shapes`` or a plug-in of the group ``monitor.shapes``.
"""

from __future__ import annotations

from typing import ClassVar, Protocol

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import Explanation
from monitor.effects.joint_error import JointError
from monitor.effects.registry import BuiltIn
from monitor.exceptions import EffectError
from monitor.machine import Joint
from monitor.records import Array
from monitor.units import Unit

#: Shorter than any period of a scale in mm (0.128 µm of the finest), and than the last digit of most positions.
SHORTEST_PITCH = 1e-4


class Shape(Protocol):
    """What every shape offers."""

    @property
    def labels(self) -> tuple[str, ...]:
        """A suffix for each coefficient; one empty one where there is a single coefficient."""
        ...

    def columns(self, context: Context, joint: int) -> Array:
        """Return the basis functions (n, k) at every probing."""
        ...

    def unit(self, base: Unit, joint: Joint) -> Unit:
        """Return the unit of the coefficients from that of the term."""
        ...


class DescribedShape(BuiltIn):
    """A shape with its own words; here with what most have: one coefficient, in the unit of the term.

    ``of_moves`` says that it follows how the axis came to its positions, not these alone.
    """

    of_moves: ClassVar[bool] = False

    @property
    def labels(self) -> tuple[str, ...]:
        return ("",)

    def unit(self, base: Unit, joint: Joint) -> Unit:
        return base

    def named(self, text: str) -> str:
        """Return the name of the shape that was read from a ``text``; here the text itself."""
        return text

    def refuse(self, text: str, error: JointError) -> None:
        """Raise EffectError where the error of an effect cannot have this shape."""

    def jumps(self, low: float, high: float) -> Array:
        """Return the readings (m,) from ``low`` to ``high``, mm or rad, at which the shape jumps."""
        return np.zeros(0)

    def kinks(self, low: float, high: float) -> Array:
        """Return the readings (m,) from ``low`` to ``high``, mm or rad, at which a straight part of the shape ends."""
        return np.zeros(0)

    def phrase(self, error: JointError) -> str:
        """Return the part of the effect's meaning that the shape makes; it begins with a comma."""
        return ""

    def explanation(self, error: JointError) -> Explanation | None:
        """Explain the effect; None where the shape says nothing of its cause."""
        return None


def parse_pitch(shape: str, written: str, example: str, word: str = "pitch") -> float:
    """Return the pitch in mm of a shape as it is written. Raises EffectError for one that no axis can have."""
    pitch = float(written)
    if not SHORTEST_PITCH <= pitch < float("inf"):
        raise EffectError(
            f"the {word} of {shape}{written}mm must be {SHORTEST_PITCH:.4f} mm or more; write for example {example}"
        )
    return pitch
