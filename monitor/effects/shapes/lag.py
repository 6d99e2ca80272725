"""``lag``: what has not settled when it is read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from monitor.effects.context import Context
from monitor.effects.description import OF_MECHANISM, ROBOTS, Explanation
from monitor.effects.joint_error import JointError
from monitor.effects.shape import DescribedShape
from monitor.machine import Joint
from monitor.records import Array
from monitor.units import METRE, RADIAN, Unit


@dataclass(frozen=True)
class Lag(DescribedShape):
    """In proportion to the last move: a reading taken before the axis has settled, or a reading that trails."""

    of_moves: ClassVar[bool] = True
    pattern: ClassVar[str] = r"lag"

    def columns(self, context: Context, joint: int) -> Array:
        return context.moves[:, joint, None]

    def unit(self, base: Unit, joint: Joint) -> Unit:
        return base.per(RADIAN if joint.turns else METRE)

    def phrase(self, error: JointError) -> str:
        return f", in proportion to the last move of {error.name}"

    def explanation(self, error: JointError) -> Explanation:
        name = error.name
        return Explanation(
            f"{name} was read before it had settled, or its reading trails the movement: waiting time too short, "
            "following error, encoder filter, time offset between control and tracker",
            f"wait longer at each pose, average readings at rest, check the following error of {name} and the clocks "
            "of control and tracker",
            ROBOTS,
            OF_MECHANISM,
        )


REGISTERED = (Lag,)
