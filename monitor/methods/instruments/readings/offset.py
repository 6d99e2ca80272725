"""``offset``: r along one direction less a straight line along the travel (a straightedge, a straightness laser)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.methods.instruments.reading import Rows, Shown, Stance, direction_of
from monitor.methods.instruments.readings.component import Zeroed
from monitor.records import Array


@dataclass(frozen=True)
class Offset(Zeroed):
    """The component of r along n, less a zero and a slope times the reading of the axis along which it travels."""

    name: ClassVar[str] = "offset"
    holdable: ClassVar[tuple[str, ...]] = ("zero", "slope")

    @property
    def unknowns(self) -> tuple[str, ...]:
        return (*super().unknowns, *(() if self.holds("slope") else ("slope",)))

    def shown(self, stance: Stance, values: Array, rows: Rows) -> Shown:
        assert self.setup.along is not None  # the reader asks for it
        along = direction_of(self.setup)
        index = rows.chain.index(self.setup.along)
        travel = rows.chain.joints[index].sign * rows.positions[:, index]
        parts = [np.ones(len(rows))] * (not self.holds("zero")) + [travel] * (not self.holds("slope"))
        line = np.column_stack(parts) if parts else np.zeros((len(rows), 0))
        return Shown(
            residual=(stance.r @ along - np.sum(line * values, axis=1))[:, None] - rows.measured,
            by_shift=np.tile(along, (len(rows), 1, 1)),
            by_own=-line[:, None, :],
        )


READING = Offset
