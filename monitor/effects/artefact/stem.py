"""``stem:gravity``: ball stems that bend as the table turns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import OWN_DOCUMENT, Description
from monitor.effects.registry import BuiltIn
from monitor.records import Array
from monitor.units import MICROMETRE, Unit


@dataclass(frozen=True)
class StemGravity(BuiltIn):
    """Bending of each ball's stem across its length as the table turns; one amplitude a ball at its full weight.

    Stems stand along the last work axis where that is rotary, so gravity along it does not bend them.
    """

    text: str = "stem:gravity"
    unit: Unit = MICROMETRE
    pattern: ClassVar[str] = r"stem:gravity"

    def labels(self, context: Context) -> tuple[str, ...]:
        return tuple(f".{ball}" for ball in np.unique(context.target))

    def shifts(self, context: Context) -> Array:
        balls = np.unique(context.target)
        if not context.chain.work:
            return np.zeros((len(context), 3, len(balls)))
        last = len(context.chain.work) - 1
        across = context.gravity[:, last].copy()
        if context.chain.joints[last].turns:
            along = np.array(context.chain.joints[last].direction)
            across -= (across @ along)[:, None] * along
        is_ball = context.target[:, None] == balls
        shifts: Array = across[:, :, None] * is_ball[:, None, :]
        return shifts

    def described(self, driven: str) -> Description:
        return Description(
            f"the ball stems bend under their own weight as the table turns{driven}",
            "stems are long or thin for the balls they carry",
            "use shorter or stiffer stems",
            OWN_DOCUMENT,
        )


REGISTERED = (StemGravity,)
