"""``angle``: the turn of the tool side against the work side about a direction (an angular laser, an autocollimator).

It is the turn away from where a machine without errors would stand, as a polygon or an index table shows it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.methods.instruments.reading import (
    LEVER,
    Rows,
    Shown,
    Stance,
    cross_matrix,
    direction_of,
    turn_vectors,
)
from monitor.methods.instruments.readings.component import Zeroed
from monitor.records import Array


@dataclass(frozen=True)
class Angle(Zeroed):
    """The turn of the tool side about n, in the frame of the last work axis, less the zero."""

    name: ClassVar[str] = "angle"
    columns: ClassVar[tuple[str, ...]] = ("reading_urad",)
    angular: ClassVar[bool] = True

    def shown(self, stance: Stance, values: Array, rows: Rows) -> Shown:
        assert stance.nominal is not None
        value, slope = turned_about(direction_of(self.setup), stance.turned, stance.nominal.turned)
        return Shown(
            residual=(value - LEVER * values.sum(axis=1))[:, None] - rows.measured,
            by_turn=slope,
            by_own=np.full((len(rows), 1, values.shape[1]), -LEVER),
            along=np.tile(direction_of(self.setup), (len(rows), 1, 1)),
        )


def turned_about(direction: Array, rotation: Array, nominal: Array) -> tuple[Array, Array]:
    """The turn (m,) about a direction (3,) from ``nominal`` to ``rotation`` (m, 3, 3) in mm at the lever, and its
    derivative (m, 1, 3) by a further turn, to second order in the turn (1e-7 of it at 1 mrad)."""
    turn = turn_vectors(rotation @ np.swapaxes(nominal, 1, 2))
    slope = direction - 0.5 * np.einsum("j,nji->ni", direction, cross_matrix(turn))
    return LEVER * (turn @ direction), LEVER * slope[:, None, :]


READING = Angle
