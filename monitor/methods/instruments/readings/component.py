"""``component``: r along one direction (a dial, a single sensor), from an unknown zero."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.methods.instruments.reading import Plain, Rows, Shown, Stance, direction_of
from monitor.records import Array


@dataclass(frozen=True)
class Zeroed(Plain):
    """A reading of one number that counts from a zero, unknown in every run unless it is known."""

    holdable: ClassVar[tuple[str, ...]] = ("zero",)
    columns: ClassVar[tuple[str, ...]] = ("reading_um",)

    @property
    def numbers(self) -> tuple[str, ...]:
        return ("reading",)

    @property
    def unknowns(self) -> tuple[str, ...]:
        return () if self.holds("zero") else ("zero",)


@dataclass(frozen=True)
class Component(Zeroed):
    """The component of r along n, less the zero."""

    name: ClassVar[str] = "component"

    def shown(self, stance: Stance, values: Array, rows: Rows) -> Shown:
        along = direction_of(self.setup)
        count = len(rows)
        return Shown(
            residual=(stance.r @ along - values.sum(axis=1))[:, None] - rows.measured,
            by_shift=np.tile(along, (count, 1, 1)),
            by_own=-np.ones((count, 1, values.shape[1])),
        )


READING = Component
