"""``harmonic1`` and so on: what repeats with the turn of a rotary axis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import MOTION_ROTARY, ROBOTS, Explanation
from monitor.effects.joint_error import JointError
from monitor.effects.shape import DescribedShape
from monitor.exceptions import EffectError
from monitor.records import Array

TIMES: dict[float, str] = {1: "once", 2: "twice", 3: "three times"}
#: What errs as often as this a turn in the drive of a table; a higher order belongs to a gear.
SOURCES: dict[float, str] = {
    1: "eccentric encoder disc or worm wheel",
    2: "oval or doubly misaligned worm wheel or encoder",
}
HIGHEST_OF_TABLES = 3


@dataclass(frozen=True)
class Harmonic(DescribedShape):
    """A cosine and a sine of a number of periods a turn; a gear has as many as its ratio, whole or not."""

    order: float
    pattern: ClassVar[str] = r"harmonic(?P<order>-?\d{1,4}(?:\.\d+)?)"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        order = groups["order"]
        if float(order) < 1.0:
            raise EffectError(
                f"the order of harmonic{order} must be 1 to 9999 periods a turn; what no turn changes is const"
            )
        return cls(float(order) if "." in order else int(order))

    @property
    def labels(self) -> tuple[str, ...]:
        return (".cos", ".sin")

    def refuse(self, text: str, error: JointError) -> None:
        if not error.joint.turns:
            raise EffectError(
                f"'{text}': a harmonic belongs to a rotary axis; for {error.name} write cyclic20mm"
            )

    def columns(self, context: Context, joint: int) -> Array:
        angle = self.order * context.places[:, joint]
        return np.column_stack([np.cos(angle), np.sin(angle)])

    def phrase(self, error: JointError) -> str:
        return f", repeating {TIMES.get(self.order, f'{self.order:g} times')} a turn"

    def explanation(self, error: JointError) -> Explanation:
        if not error.is_of_drive:
            motion = "face run-out and wobble" if error.term.is_rotation else "run-out"
            return Explanation(
                f"bearing {motion} of {error.name}, or its bearing seat is not round",
                f"check bearing preload, seat and wear of {error.name}, or compensate by its angle",
                MOTION_ROTARY,
            )
        if self.order > HIGHEST_OF_TABLES:
            return Explanation(
                f"gear of {error.name} with {self.order:g} errors a turn: eccentric pinion, tooth form, or the two "
                "waves of a strain wave gear's generator",
                f"check wear, lubrication and mounting of the gearbox of {error.name}, or enter a cyclic compensation "
                "by its angle",
                ROBOTS,
            )
        return Explanation(
            f"{SOURCES.get(self.order, 'worm wheel, gear or encoder error')} of {error.name}",
            f"check the encoder's centring and the worm drive of {error.name}, or enter an indexing compensation table",
            MOTION_ROTARY,
        )


REGISTERED = (Harmonic,)
