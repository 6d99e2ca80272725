"""``displacement``: the change of r along a beam since the first row of the run (a linear laser interferometer).

The beam's direction is known to 1 mrad across the stated one, or as the setup states it. Its turn acts in two ways. A
point that moves across the beam shows it to first order. Of a travel along the beam only the cosine error is left,
(a^2 + b^2) / 2 of the travel, of which nothing but its distribution is known: for two normal angles of u it has mean
and standard deviation u^2 (chi-square of two degrees of freedom). It is corrected by its mean (GUM, F.2.4.4) and has an
unknown of its own, in which the readings are linear. The first row reads zero with its own noise in it, so the zero is
an unknown too, and every row counts once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.methods.instruments.reading import COSINE, Plain, Rows, Shown, Stance, direction_of
from monitor.records import Array
from monitor.sources import SCALE

#: A laser is set up along an axis to a millimetre over a metre.
BEAM = 1e-3
#: The unknown angles of a beam, across its stated direction.
BEAM_ANGLES = ("beam a", "beam b")


@dataclass(frozen=True)
class Displacement(Plain):
    """The component of r along the beam, less that of the first row."""

    name: ClassVar[str] = "displacement"
    columns: ClassVar[tuple[str, ...]] = ("reading_um",)
    holdable: ClassVar[tuple[str, ...]] = ("direction", SCALE)
    relative: ClassVar[bool] = True

    @property
    def numbers(self) -> tuple[str, ...]:
        return ("reading",)

    @property
    def unknowns(self) -> tuple[str, ...]:
        return ("zero",) if self.holds("direction") else ("zero", *BEAM_ANGLES, COSINE)

    @property
    def beam(self) -> float:
        """The standard uncertainty of each of the beam's two angles in rad."""
        return self.setup.direction_uncertainty or BEAM

    def prior(self) -> tuple[tuple[int, float], ...]:
        return () if self.holds("direction") else ((1, self.beam), (2, self.beam), (3, self.beam**2))

    def shown(self, stance: Stance, values: Array, rows: Rows) -> Shown:
        along = direction_of(self.setup)
        by_own = np.zeros((len(rows), 1, values.shape[1]))
        by_own[:, 0, 0] = -1.0
        if self.holds("direction"):
            shown = stance.r @ along
            by_shift = np.tile(along, (len(rows), 1, 1))
            return Shown((shown - values[:, 0])[:, None] - rows.measured, by_shift, by_own=by_own)
        across = np.linalg.svd(along[None, :])[2][1:]
        beam = along * (1.0 - self.beam**2 - values[:, 3:]) + values[:, 1:3] @ across
        by_own[:, 0, 1:3] = stance.r @ across.T
        by_own[:, 0, 3] = -stance.r @ along
        shown = np.einsum("ni,ni->n", stance.r, beam)
        return Shown((shown - values[:, 0])[:, None] - rows.measured, beam[:, None, :], by_own=by_own)


READING = Displacement
