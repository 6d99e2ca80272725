"""``distance``: the length of r less the nominal length (a ball bar, a telescoping bar, a distance between spheres)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.methods.instruments.reading import Rows, Shown, Stance
from monitor.methods.instruments.readings.vector import AtWorkPoint
from monitor.records import Array


@dataclass(frozen=True)
class DistanceReading(AtWorkPoint):
    """The length of r. What the bar's length is off is unknown, to its uncertainty where that is stated."""

    name: ClassVar[str] = "distance"
    columns: ClassVar[tuple[str, ...]] = ("reading_um",)
    holdable: ClassVar[tuple[str, ...]] = ("work_point", "length")

    @property
    def numbers(self) -> tuple[str, ...]:
        return ("reading",)

    @property
    def unknowns(self) -> tuple[str, ...]:
        return (*super().unknowns, *(() if self.holds("length") else ("length",)))

    def prior(self) -> tuple[tuple[int, float], ...]:
        u = self.setup.length_uncertainty
        return () if u is None or self.holds("length") else ((len(self.unknowns) - 1, u),)

    def shown(self, stance: Stance, values: Array, rows: Rows) -> Shown:
        assert self.setup.length is not None  # the reader asks for it
        long = np.linalg.norm(stance.r, axis=1)
        by_shift = (stance.r / np.maximum(long, 1e-12)[:, None])[:, None, :]
        by_own = self.by_point(by_shift, values)
        nominal = np.full(len(rows), self.setup.length)
        if not self.holds("length"):
            by_own[:, :, -1] = -1.0
            nominal = nominal + values[:, -1]
        return Shown((long - nominal)[:, None] - rows.measured, by_shift, by_own=by_own)


READING = DistanceReading
