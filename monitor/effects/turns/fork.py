"""``fork:DEC@gravity``: what carries an axis bends under its own weight, and turns that axis about itself.

The arms of a fork mount stand along the polar axis and carry the declination axis between them. Gravity across both
bends them, by one coefficient times its component there: of an equatorial fork the cosine of the hour angle (P. T.
Wallace, TPOINT, term FO). Across the axis that is carried a fork is stiff, and along its own arms nothing bends it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import OWN_DOCUMENT, Description
from monitor.effects.registry import BuiltIn
from monitor.exceptions import EffectError
from monitor.machine import Chain
from monitor.records import Array
from monitor.units import MICRORADIAN, Unit


@dataclass(frozen=True)
class Fork(BuiltIn):
    """Bending of what stands on one turning axis of the tool's side and carries the next one across it."""

    carried: str
    unit: Unit = MICRORADIAN
    pattern: ClassVar[str] = r"fork:(?P<carried>[A-Za-z][A-Za-z0-9]*)@gravity"

    @property
    def text(self) -> str:
        return f"fork:{self.carried}@gravity"

    def labels(self, context: Context) -> tuple[str, ...]:
        return ("",)

    def joint(self, chain: Chain) -> int:
        names = carried_axes(chain)
        if self.carried not in names:
            carried = ", ".join(names) or "none here"
            raise EffectError(
                f"'{self.text}': {self.carried} is no turning axis across another that carries it; "
                f"here these are {carried}"
            )
        return chain.index(self.carried) - 1

    def turns(self, context: Context) -> Array:
        arm = self.joint(context.chain)
        about = np.array(context.chain.joints[arm + 1].direction)
        across = np.cross(about, np.array(context.chain.joints[arm].direction))
        turns: Array = (context.gravity[:, arm] @ across)[:, None, None] * about[None, :, None]
        return turns

    def described(self, driven: str) -> Description:
        return Description(
            f"what carries the axis {self.carried} bends under its own weight and turns {self.carried} about "
            f"itself, in proportion to the component of gravity across both axes{driven}",
            "the arms of a fork, or the stand that carries the axis, give way under the weight that hangs on them",
            "stiffen or balance it, or compensate by the position of the axis that it stands on",
            OWN_DOCUMENT,
        )


def carried_axes(chain: Chain) -> tuple[str, ...]:
    """The turning axes of the tool's side that stand across the turning axis before them."""
    return tuple(
        after.name
        for before, after in zip(chain.tool, chain.tool[1:], strict=False)
        if before.turns and after.turns and abs(np.dot(before.direction, after.direction)) < 1.0 - 1e-9
    )


REGISTERED = (Fork,)
