"""``windup40mm``: the reversal of a drive that gives way before it follows (hysteresis with a width)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import POSITIONING, Explanation
from monitor.effects.joint_error import JointError
from monitor.effects.shape import DescribedShape
from monitor.exceptions import EffectError
from monitor.records import Array


@dataclass(frozen=True)
class WindUp(DescribedShape):
    """Half the reversal error, which builds up evenly over a width in millimetres of travel after each reversal.

    Moves shorter than the width leave it in between, as a play operator does. What a control does while it positions (a
    small overshoot) is not seen.
    """

    width: float
    pattern: ClassVar[str] = r"windup(?P<width>\d+(?:\.\d+)?)mm"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        return cls(float(groups["width"]))

    def refuse(self, text: str, error: JointError) -> None:
        if error.joint.turns:
            raise EffectError(
                f"'{text}': a width in mm belongs to a linear axis; for {error.name} write reversal"
            )

    def columns(self, context: Context, joint: int) -> Array:
        if self.width <= 0:
            raise EffectError(f"the width of windup{self.width:g}mm must be above 0 mm")
        return wound_up(context, joint, self.width)[:, None]

    def phrase(self, error: JointError) -> str:
        return f", turning over within {self.width:g} mm of travel when {error.name} reverses"

    def explanation(self, error: JointError) -> Explanation:
        name = error.name
        return Explanation(
            f"the drive of {name} is wound up by friction before it follows: long screw or thin coupling, dry or "
            "tight guide, covers and seals that drag",
            f"check lubrication, preload and covers of {name}; a compensation of the reversal value is right after "
            "long moves alone",
            POSITIONING,
        )


def wound_up(context: Context, joint: int, width: float) -> Array:
    """How far (n,), from -1 to 1, an axis is ahead of what it drags along with a play of half the ``width``.

    The play operator of hysteresis: what is dragged stands still until one side of the play touches. Every run starts
    in the middle, with the axis at zero (Visintin, Differential Models of Hysteresis, 1994, III.2).
    """
    half = width / 2.0
    ahead = np.zeros(len(context))
    position = context.places[:, joint]
    for rows in context.stretches:
        dragged = 0.0
        for row, at in zip(rows.tolist(), position[rows].tolist(), strict=True):
            dragged = min(max(dragged, at - half), at + half)
            ahead[row] = (at - dragged) / half
    return ahead


REGISTERED = (WindUp,)
