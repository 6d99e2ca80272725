"""``table(-110,0!,110)``: a free form along the travel, on nodes that the user names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from monitor.effects.context import Context
from monitor.effects.joint_error import JointError
from monitor.effects.shape import DescribedShape
from monitor.effects.shapes.table import PHRASE
from monitor.exceptions import EffectError
from monitor.records import Array
from monitor.units import DEGREE


@dataclass(frozen=True)
class Nodes(DescribedShape):
    """Hat functions on nodes that the user names: readings of the axis in mm or degrees, in rising order.

    Each is a coefficient of its own, named by its reading, but for those that are ``held`` at zero (written with an
    exclamation mark). Beyond the last node the error stays as it is there.
    """

    places: tuple[tuple[float, bool], ...]
    pattern: ClassVar[str] = r"table\((?P<places>[^)]*)\)"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        return cls(parse_places(groups["places"]))

    @property
    def readings(self) -> tuple[float, ...]:
        """The readings of all nodes, held ones too."""
        return tuple(reading for reading, _ in self.places)

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(f"({reading:.9g})" for reading, held in self.places if not held)

    def columns(self, context: Context, joint: int) -> Array:
        axis = context.chain.joints[joint]
        reading = axis.sign * context.places[:, joint] / (DEGREE.factor if axis.turns else 1.0)
        free = [number for number, (_, held) in enumerate(self.places) if not held]
        hats = np.eye(len(self.places))
        return np.column_stack(
            [np.interp(reading, self.readings, hats[number]) for number in free]
            or [np.zeros((len(reading), 0))]
        )

    def phrase(self, error: JointError) -> str:
        return PHRASE


def parse_places(text: str) -> tuple[tuple[float, bool], ...]:
    """Return the nodes of ``-110,0!,110``. Raises EffectError where they are no numbers in rising order."""
    try:
        places = tuple(
            (float(word.strip().removesuffix("!")), word.strip()[-1] == "!") for word in text.split(",")
        )
    except (ValueError, IndexError):
        places = ()
    readings = [reading for reading, _ in places]
    if not readings or not np.all(np.isfinite(readings)) or np.any(np.diff(readings) <= 0.0):
        raise EffectError(
            f"the nodes of table({text}) must be numbers in rising order, for example table(-100,0,100)"
        )
    return places


def nodes_text(readings: Iterable[float], held: Iterable[float] = ()) -> str:
    """Return the shape as written: ``table(-110,0!,110)``."""
    fixed = set(held)
    return f"table({','.join(f'{reading:.9g}' + '!' * (reading in fixed) for reading in readings)})"


REGISTERED = (Nodes,)
