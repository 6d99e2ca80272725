"""What a turn is: an angle about a direction that changes with the pose, so that it adds to several terms at once.

A tube that sags turns about whatever lies level across it: with the pose this is a tilt about one direction of the
tool, then about the other, by one and the same coefficient. Another turn is one more file of ``turns``.
"""

from __future__ import annotations

from typing import Protocol

from monitor.effects.change import Change
from monitor.effects.context import Context
from monitor.machine import Chain
from monitor.records import Array


class Turn(Change, Protocol):
    """A turn of all that one joint carries."""

    def joint(self, chain: Chain) -> int:
        """Return the index of the joint that carries what turns. Raises EffectError where the chain has none."""
        ...

    def turns(self, context: Context) -> Array:
        """Return the turn vectors (n, 3, k) for a unit of each coefficient, in the frame of the joint after its
        motion."""
        ...
