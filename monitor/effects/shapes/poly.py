"""``poly1`` to ``poly9``: a power of the position."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

from monitor.effects.context import Context
from monitor.effects.description import LOCATION_ERRORS, Explanation, power_of
from monitor.effects.joint_error import JointError
from monitor.effects.shape import DescribedShape
from monitor.machine import Joint
from monitor.records import Array
from monitor.units import METRE, RADIAN, Unit


@dataclass(frozen=True)
class Poly(DescribedShape):
    """A power of the position; the coefficient is per metre or radian to that power."""

    order: int
    pattern: ClassVar[str] = r"poly(?P<order>[1-9])"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        return cls(int(groups["order"]))

    def columns(self, context: Context, joint: int) -> Array:
        return context.places[:, joint, None] ** self.order

    def unit(self, base: Unit, joint: Joint) -> Unit:
        length = RADIAN if joint.turns else METRE
        power = {1: "", 2: "²", 3: "³"}.get(self.order, f"^{self.order}")
        return base.per(Unit(f"{length.name}{power}", length.factor**self.order))

    def phrase(self, error: JointError) -> str:
        return f", growing {power_of(self.order)} its position"

    def explanation(self, error: JointError) -> Explanation | None:
        across = not (error.term.is_rotation or error.is_along or error.joint.turns)
        if self.order > 1 or not across:
            return None
        axis, name = "XYZ"[error.term.component % 3], error.name
        return Explanation(
            f"{name} is not square to {axis}: settled, knocked out of alignment, or assembled so",
            f"re-align {name}, or enter the squareness of {name} and {axis} in the control's table",
            LOCATION_ERRORS,
        )


REGISTERED = (Poly,)
