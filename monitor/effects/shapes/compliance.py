"""``compliance``: what gives way under weights; ``monitor.effects.weight`` has its drivers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import OF_MECHANISM, ROBOTS, Explanation
from monitor.effects.joint_error import JointError
from monitor.effects.shape import DescribedShape
from monitor.exceptions import EffectError
from monitor.records import Array


def example_of(error: JointError) -> str:
    """Return a compliance of the joint's own axis, for messages."""
    return f"E{'ABC'[error.joint.main]}{error.name}:compliance@gravity"


@dataclass(frozen=True)
class Compliance(DescribedShape):
    """In proportion to the torque of weights further out, which its driver gives."""

    pattern: ClassVar[str] = r"compliance"

    def refuse(self, text: str, error: JointError) -> None:
        if error.term.is_rotation and not error.is_location and error.joint.turns:
            return
        turns = error.joint.turns
        example = f"write for example {example_of(error)}" if turns else f"{error.name} does not turn"
        raise EffectError(f"'{text}': a compliance is a rotation of a rotary axis under a torque; {example}")

    def columns(self, context: Context, joint: int) -> Array:
        return np.ones((len(context), 1))

    def explanation(self, error: JointError) -> Explanation:
        name, part = error.name, "drive and gearbox" if error.is_of_drive else "bearings and arm"
        return Explanation(
            f"{part} of {name} give way under the weight that {name} carries",
            f"enter the payload and its centre of mass in the control, balance or reduce the load, check the {part} of "
            f"{name} for play, or compensate the angle by the torque",
            ROBOTS,
            OF_MECHANISM,
        )


REGISTERED = (Compliance,)
