"""``displacement``: the change of r along a beam since the first row of the run (a linear laser interferometer).

The beam's direction is known to 1 mrad across the stated one: its cosine error is an unknown like any other. The first
row reads zero with its own noise in it, so the zero is an unknown too, and every row counts once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.methods.instruments.reading import Plain, Rows, Shown, Stance, direction_of
from monitor.records import Array

#: A laser is set up along an axis to a millimetre over a metre.
BEAM = 1e-3


@dataclass(frozen=True)
class Displacement(Plain):
    """The component of r along the beam, less that of the first row."""

    name: ClassVar[str] = "displacement"
    columns: ClassVar[tuple[str, ...]] = ("reading_um",)
    holdable: ClassVar[tuple[str, ...]] = ("direction",)

    @property
    def numbers(self) -> tuple[str, ...]:
        return ("reading",)

    @property
    def unknowns(self) -> tuple[str, ...]:
        return ("zero",) if self.holds("direction") else ("zero", "beam a", "beam b")

    def prior(self) -> tuple[tuple[int, float], ...]:
        return () if self.holds("direction") else ((1, BEAM), (2, BEAM))

    def shown(self, stance: Stance, values: Array, rows: Rows) -> Shown:
        along = direction_of(self.setup)
        across = np.linalg.svd(along[None, :])[2][1:]
        off = values[:, 1:] @ across if values.shape[1] > 1 else np.zeros((len(rows), 3))
        beam = along + off
        size = np.linalg.norm(beam, axis=1, keepdims=True)
        beam = beam / size
        by_own = np.zeros((len(rows), 1, values.shape[1]))
        by_own[:, 0, 0] = -1.0
        shown = np.einsum("ni,ni->n", stance.r, beam)
        if values.shape[1] > 1:
            by_own[:, 0, 1:] = (stance.r @ across.T - shown[:, None] * (beam @ across.T)) / size
        return Shown((shown - values[:, 0])[:, None] - rows.measured, beam[:, None, :], by_own=by_own)


READING = Displacement
