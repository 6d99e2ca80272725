"""``vector``: the three components of r (an R-test, a nest of sensors on a sphere, a sphere that is probed)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.methods.instruments.reading import Plain, Rows, Shown, Stance, cross_matrix
from monitor.records import Array

WORK_POINT = ("work point x", "work point y", "work point z")


@dataclass(frozen=True)
class AtWorkPoint(Plain):
    """A reading whose work point is unknown in every run, unless it is known."""

    holdable: ClassVar[tuple[str, ...]] = ("work_point",)

    @property
    def unknowns(self) -> tuple[str, ...]:
        return () if self.holds("work_point") else WORK_POINT

    def start(self, runs: int) -> Array:
        stated = np.zeros(len(self.unknowns))
        if not self.holds("work_point"):
            stated[:3] = self.setup.work_point
        return np.tile(stated, (runs, 1))

    def ends(self, values: Array, rows: Rows) -> tuple[Array, Array]:
        work, tool = super().ends(values, rows)
        return (work if self.holds("work_point") else values[:, :3].copy()), tool

    def by_point(self, by_shift: Array, values: Array) -> Array:
        """Derivatives (m, k, q) by the unknowns, of which the work point is the first."""
        by_own = np.zeros((*by_shift.shape[:2], values.shape[1]))
        if not self.holds("work_point"):
            by_own[:, :, :3] = -by_shift
        return by_own


@dataclass(frozen=True)
class VectorReading(AtWorkPoint):
    """The vector r in the frame of the last work axis, or in that of the last tool axis."""

    name: ClassVar[str] = "vector"
    columns: ClassVar[tuple[str, ...]] = ("dx_um", "dy_um", "dz_um")

    @property
    def numbers(self) -> tuple[str, ...]:
        return ("x", "y", "z")

    def shown(self, stance: Stance, values: Array, rows: Rows) -> Shown:
        if self.setup.frame == "work":
            by_shift = np.tile(np.eye(3), (len(rows), 1, 1))
            return Shown(stance.r - rows.measured, by_shift, by_own=self.by_point(by_shift, values))
        by_shift = np.swapaxes(stance.turned, 1, 2)
        return Shown(
            residual=np.einsum("nij,nj->ni", by_shift, stance.r) - rows.measured,
            by_shift=by_shift,
            by_turn=by_shift @ cross_matrix(stance.r),
            by_own=self.by_point(by_shift, values),
        )


READING = VectorReading
