"""``windup40mm``, ``windup40deg``: the reversal of a drive that gives way before it follows, over a width."""

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
from monitor.machine import Joint
from monitor.records import Array


@dataclass(frozen=True)
class WindUp(DescribedShape):
    """Half the reversal error, which builds up evenly over a width of travel after each reversal, in ``width_unit``:
    mm of linear axes, deg of rotary ones.

    Moves shorter than the width leave it in between, as a play operator does. What a control does while it positions (a
    small overshoot) is not seen.
    """

    width: float
    width_unit: str = "mm"
    of_moves: ClassVar[bool] = True
    pattern: ClassVar[str] = r"windup(?P<width>-?\d+(?:\.\d+)?)(?P<unit>mm|deg)"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        width, unit = float(groups["width"]), groups["unit"]
        if not 0.0 < width < float("inf"):
            raise EffectError(
                f"the width of windup{groups['width']}{unit} must be above 0 {unit}; write reversal for what turns "
                "over at once"
            )
        return cls(width, unit)

    @property
    def text(self) -> str:
        """The shape as written, with four digits of the width."""
        return f"windup{self.width:.4g}{self.width_unit}"

    def refuse(self, text: str, error: JointError) -> None:
        unit = unit_of_width(error.joint)
        if self.width_unit != unit:
            kind = "linear" if error.joint.turns else "rotary"
            raise EffectError(
                f"'{text}': a width in {self.width_unit} belongs to a {kind} axis; for {error.name} write "
                f"windup{self.width:g}{unit}"
            )

    def columns(self, context: Context, joint: int) -> Array:
        width = np.deg2rad(self.width) if self.width_unit == "deg" else self.width
        return wound_up(context, joint, float(width))[:, None]

    def phrase(self, error: JointError) -> str:
        width = f"{self.width:g}°" if error.joint.turns else f"{self.width:g} mm"
        return f", turning over within {width} of travel when {error.name} reverses"

    def explanation(self, error: JointError) -> Explanation:
        name = error.name
        if error.joint.turns:
            return Explanation(
                f"the drive of {name} is wound up by friction before it follows: worm or belt that gives way, slender "
                "shaft, tight bearing or seal, a clamp that drags",
                f"check lubrication, clamp and seals of {name} and the preload of its gear; a compensation of the "
                "reversal value is right after long moves alone",
                POSITIONING,
            )
        return Explanation(
            f"the drive of {name} is wound up by friction before it follows: long screw or thin coupling, dry or "
            "tight guide, covers and seals that drag",
            f"check lubrication, preload and covers of {name}; a compensation of the reversal value is right after "
            "long moves alone",
            POSITIONING,
        )


def unit_of_width(joint: Joint) -> str:
    """The unit in which the widths of an axis are written."""
    return "deg" if joint.turns else "mm"


def wound_up(context: Context, joint: int, width: float) -> Array:
    """How far (n,), from -1 to 1, an axis is ahead of what it drags along with a play of half the ``width``.

    Position and ``width`` are in mm, in rad of a rotary axis. The play operator of hysteresis: what is dragged stands
    still until one side of the play touches. Every run starts in the middle, with the axis at zero (Visintin,
    Differential Models of Hysteresis, 1994, III.2); a row that was approached anew has gone through the play.
    """
    half = width / 2.0
    ahead = np.zeros(len(context))
    position = context.places[:, joint]
    for rows in context.stretches:
        dragged = 0.0
        for row, at in zip(rows.tolist(), position[rows].tolist(), strict=True):
            dragged = min(max(dragged, at - half), at + half)
            if context.approach is not None and context.approach[row, joint]:
                dragged = at - context.approach[row, joint] * half
            ahead[row] = (at - dragged) / half
    return ahead


REGISTERED = (WindUp,)
