"""``@gravity``: the weight that turns with an axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from monitor.effects.context import Context
from monitor.effects.description import MOTION_ROTARY, OF_DRIVER, Explanation
from monitor.effects.driver import DescribedDriver
from monitor.effects.joint_error import JointError
from monitor.records import Array


@dataclass(frozen=True)
class Gravity(DescribedDriver):
    """The components of gravity in the frame of the axis, as parts of its full weight."""

    pattern: ClassVar[str] = r"gravity"

    @property
    def phrase(self) -> str:
        return ", following the direction of gravity as the axis turns"

    def labels(self, context: Context) -> tuple[str, ...]:
        return (".gx", ".gy", ".gz")

    def columns(self, context: Context, joint: int | None) -> Array:
        return context.gravity[:, len(context.chain.work) - 1 if joint is None else joint]

    def explanation(self, error: JointError) -> Explanation:
        return Explanation(
            f"the weight on {error.name} bends it as it turns",
            f"reduce or balance the load on {error.name}, check its bearings' preload, or compensate by its angle",
            MOTION_ROTARY,
            OF_DRIVER,
        )


REGISTERED = (Gravity,)
