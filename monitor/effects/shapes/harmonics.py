"""``harmonics(1,2,121,242)``: the curve of a rotary joint, of several lines at once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, Self

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import OF_MECHANISM, ROBOTS, Explanation
from monitor.effects.joint_error import JointError
from monitor.effects.shape import DescribedShape
from monitor.effects.shapes.harmonic import HIGHEST_OF_TABLES
from monitor.exceptions import EffectError
from monitor.records import Array

# What repeats as often as this is no line of a gear (ratios reach some 330, its teeth twice that) but noise.
HIGHEST = 9999.0


@dataclass(frozen=True)
class Harmonics(DescribedShape):
    """A cosine and a sine of every order, in periods a turn, each named by its order: ``(121).cos``."""

    orders: tuple[float, ...]
    pattern: ClassVar[str] = r"harmonics\((?P<orders>[^)]*)\)"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        return cls(parse_orders(groups["orders"]))

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(f"({order:g}).{wave}" for order in self.orders for wave in ("cos", "sin"))

    def refuse(self, text: str, error: JointError) -> None:
        if not error.joint.turns:
            raise EffectError(
                f"'{text}': harmonics belong to a rotary axis; for {error.name} write table(0,100,200)"
            )

    def columns(self, context: Context, joint: int) -> Array:
        angles = np.outer(context.places[:, joint], self.orders)
        return np.stack([np.cos(angles), np.sin(angles)], axis=-1).reshape(len(angles), -1)

    def phrase(self, error: JointError) -> str:
        return f", a curve of {len(self.orders)} harmonics: {orders_text(self.orders)} periods a turn"

    def explanation(self, error: JointError) -> Explanation | None:
        if not error.is_of_drive:
            return None
        low = [order for order in self.orders if order <= HIGHEST_OF_TABLES]
        high = [order for order in self.orders if order > HIGHEST_OF_TABLES]
        causes = []
        if low:
            causes.append(
                f"an eccentric or tilted encoder or bearing at the output side ({orders_text(low)} a turn)"
            )
        if high:
            causes.append(
                f"the gear, or an eccentric encoder at the motor side ({orders_text(high)} a turn: once and twice the "
                "ratio and their multiples belong to the motor shaft and the wave generator, others to teeth and "
                "bearings)"
            )
        return Explanation(
            f"{error.name}: " + ", and ".join(causes),
            f"check wear, lubrication and mounting of the gearbox of {error.name} and the centring of its encoder, or "
            "compensate the angle by this curve",
            ROBOTS,
            OF_MECHANISM,
        )


def parse_orders(text: str) -> tuple[float, ...]:
    """Return the orders of ``1,2,121.5``. Raises EffectError where they are no positive numbers in rising order."""
    try:
        orders = tuple(float(word) for word in text.split(","))
    except ValueError:
        orders = ()
    if (
        not orders
        or not all(0.0 < order <= HIGHEST for order in orders)
        or any(first >= second for first, second in pairwise(orders))
    ):
        raise EffectError(
            f"the orders of harmonics({text}) must be periods a turn, above 0 and rising, for example "
            "harmonics(1,2,121,242)"
        )
    return orders


def orders_text(orders: Iterable[float]) -> str:
    """Return orders as written in the shape and read in sentences: ``1, 2, 121``."""
    return ", ".join(f"{order:g}" for order in orders)


def harmonics_text(orders: Iterable[float]) -> str:
    """Return the shape as written: ``harmonics(1,2,121)``."""
    return f"harmonics({','.join(f'{order:g}' for order in sorted(orders))})"


REGISTERED = (Harmonics,)
