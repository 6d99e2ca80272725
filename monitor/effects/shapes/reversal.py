"""``reversal``: the play of an axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from monitor.effects.context import Context
from monitor.effects.description import POSITIONING, Explanation
from monitor.effects.joint_error import JointError
from monitor.effects.shape import DescribedShape
from monitor.records import Array

#: ISO 230-2:2014, 3.15: the reversal value is the difference of the positions reached from the two directions, so twice
#: the amplitude, which adds to one and is taken off the other.
REVERSAL_VALUE = 2.0


def has_reversal_value(effect: str) -> bool:
    """Whether an effect, as written, is a play of constant size: one that a reversal value states."""
    return effect.partition(":")[2] == "reversal"


@dataclass(frozen=True)
class Reversal(DescribedShape):
    """Half the reversal error, with the sign of the axis's last travel."""

    of_moves: ClassVar[bool] = True
    pattern: ClassVar[str] = r"reversal"

    def columns(self, context: Context, joint: int) -> Array:
        return context.travel[:, joint, None]

    def phrase(self, error: JointError) -> str:
        return f", jumping when {error.name} reverses"

    def explanation(self, error: JointError) -> Explanation:
        name = error.name
        if error.is_of_drive:
            return Explanation(
                f"backlash or wind-up of the drive of {name}: worn nut, loose coupling or thrust bearing, friction",
                f"check nut, coupling and thrust bearing of {name}; then set the control's backlash compensation "
                "to the reversal value, which is twice the amplitude",
                POSITIONING,
            )
        if error.joint.turns:
            return Explanation(
                f"play in the bearing of {name} lets what it carries shift or tilt when it reverses",
                f"check preload and wear of the bearing of {name}; it cannot be compensated well",
                POSITIONING,
            )
        return Explanation(
            f"play in the guide of {name} lets the carriage shift or tilt when it reverses",
            f"check preload, gibs and wear of the guide of {name}; it cannot be compensated well",
            POSITIONING,
        )


REGISTERED = (Reversal,)
