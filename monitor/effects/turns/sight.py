"""``sight:up:formula(1/tan(elevation))``: a line of sight that is bent, up or sideways, by a typed formula.

Besides the recorded columns the formula may name ``elevation``, the angle of the line of sight above the horizontal
in rad, as the nominal chain and the direction of gravity give it. Refraction lifts what is seen by nearly
1/tan(elevation) (F. Bessel; within 1 % above 15 degrees).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import OWN_DOCUMENT, Description
from monitor.effects.formula import Formula
from monitor.effects.registry import BuiltIn
from monitor.exceptions import EffectError
from monitor.machine import Chain
from monitor.records import Array
from monitor.units import MICRORADIAN, Unit

#: The name under which formulas know the angle of the line of sight above the horizontal.
ELEVATION = "elevation"
# Nearer to the vertical than this (rad) up and sideways have no direction: one step of a double of its cosine.
UPRIGHT = 1e-8


@dataclass(frozen=True)
class Sight(BuiltIn):
    """The line of sight turned ``up`` or to the ``side`` (towards the direction of gravity cross the line of sight)."""

    way: str
    formula: str
    unit: Unit = MICRORADIAN
    pattern: ClassVar[str] = r"sight:(?P<way>up|side):formula\((?P<formula>.*)\)"

    def __post_init__(self) -> None:
        Formula(self.formula).check()

    @property
    def text(self) -> str:
        return f"sight:{self.way}:formula({self.formula})"

    def labels(self, context: Context) -> tuple[str, ...]:
        return ("",)

    def joint(self, chain: Chain) -> int:
        if not chain.tool:
            raise EffectError(f"'{self.text}': '{chain.topology}' has no axis on the tool's side")
        return len(chain.joints) - 1

    def turns(self, context: Context) -> Array:
        joint = self.joint(context.chain)
        if context.sight is None:
            raise EffectError(f"'{self.text}': nothing says where the tool points (tool_direction)")
        up = -context.gravity[:, joint]
        sine = np.einsum("ni,ni->n", up, context.sight)
        level = np.cross(context.sight, up)
        length = np.linalg.norm(level, axis=1, keepdims=True)
        level = np.where(length > UPRIGHT, level / np.maximum(length, UPRIGHT), 0.0)
        columns = {**context.columns, ELEVATION: np.arcsin(np.clip(sine, -1.0, 1.0))}
        size = Formula(self.formula).evaluate(columns, len(context))
        # Up: a turn about the level direction across; sideways: one about what is perpendicular to both.
        about = level if self.way == "up" else np.cross(context.sight, level)
        turns: Array = (about * size[:, None])[:, :, None]
        return turns

    def described(self, driven: str) -> Description:
        way = "up" if self.way == "up" else "sideways"
        return Description(
            f"the line of sight is bent {way}, following {self.formula}{driven}",
            "refraction in the air that was not corrected, or corrected with another pressure or temperature; a "
            "sag that grows towards the horizon looks alike",
            "check pressure, temperature, humidity and wavelength of the refraction correction, or compensate by the "
            "elevation",
            OWN_DOCUMENT,
        )


REGISTERED = (Sight,)
